"""The polynomial mass flux is the isentropic one: choked, antisymmetric, linear near rest."""

import numba
import numpy as np
import pytest

from epv_env.plant import primitives

INVERSE_SQRT_RT = 1 / np.sqrt(287.14 * 293.0)
P_UP = 10e5


@numba.vectorize
def mass_flux(p_a, p_b):
    """The plant's flux as a NumPy function [kg/(s m^2)]."""
    return primitives.mass_flux(p_a, p_b, INVERSE_SQRT_RT)


def isentropic_flux(p_a, p_b):
    """Eq. 13 with m1/V1 = p1/(R T1), choked below the critical ratio, in extended precision."""
    kappa = np.longdouble(primitives.KAPPA)
    ratio = np.maximum(np.longdouble(p_b) / p_a, (2 / (kappa + 1)) ** (kappa / (kappa - 1)))
    # r^(2/k) - r^((k+1)/k), written so that it keeps its digits near r = 1
    bracket = -(ratio ** (2 / kappa)) * np.expm1((kappa - 1) / kappa * np.log(ratio))
    return p_a * INVERSE_SQRT_RT * np.sqrt(2 * kappa / (kappa - 1) * bracket)


def test_flux_is_isentropic_within_the_stated_error_over_all_ratios():
    ratio = np.concatenate(
        [np.linspace(1e-4, 0.999, 200_001), 1 - np.geomspace(primitives.LAMINAR_DROP, 1e-3, 2001)]
    )
    error = np.abs(mass_flux(P_UP, ratio * P_UP) / isentropic_flux(P_UP, ratio * P_UP) - 1)
    assert np.max(error) <= primitives.MAX_RELATIVE_ERROR


def test_flux_chokes_at_the_closed_form():
    kappa = primitives.KAPPA
    choked = P_UP * INVERSE_SQRT_RT * np.sqrt(kappa * (2 / (kappa + 1)) ** ((kappa + 1) / (kappa - 1)))
    ratio = np.linspace(1e-3, primitives.CRITICAL_RATIO, 1001)
    flux = mass_flux(P_UP, ratio * P_UP)
    assert np.ptp(flux) <= 1e-15 * choked
    assert flux[0] == pytest.approx(choked, rel=primitives.MAX_RELATIVE_ERROR)
    assert mass_flux(P_UP, 1.01 * primitives.CRITICAL_RATIO * P_UP) < flux[0]


def test_flux_is_antisymmetric_to_the_bit():
    p_a, p_b = np.random.default_rng(0).uniform(0.5e5, 14e5, (2, 10_000))
    np.testing.assert_array_equal(mass_flux(p_a, p_b), -mass_flux(p_b, p_a))


def test_flux_is_linear_in_the_laminar_region():
    drop = np.linspace(1e-9, primitives.LAMINAR_DROP, 1001)
    slope = mass_flux(P_UP, (1 - drop) * P_UP) / drop
    assert np.ptp(slope) <= primitives.LAMINAR_DROP * slope[0]


@pytest.mark.parametrize(
    "seam", [1 - primitives.LAMINAR_DROP, primitives.CRITICAL_RATIO, 1.0, 1 + primitives.LAMINAR_DROP]
)
def test_flux_is_continuous_across_seams(seam):
    near = mass_flux(P_UP, (seam + np.array([-1e-12, 1e-12])) * P_UP)
    assert abs(near[1] - near[0]) <= 1e-7 * mass_flux(P_UP, 1e5)
