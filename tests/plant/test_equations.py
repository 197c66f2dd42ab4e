"""The state equations and the mass flux against second typings, closed forms and energy balances."""

import numba
import numpy as np
import pytest

from epv_env.plant import primitives
from epv_env.plant.coefficients import coefficients
from epv_env.plant.effects.registry import Effects, effect_constants
from epv_env.plant.equations import (
    Coefficients,
    Inputs,
    State,
    armature_force,
    current_rate,
    piston_force,
    reluctance_inverse,
)
from epv_env.plant.parameters import Parameters
from epv_env.plant.primitives import MAX_RELATIVE_ERROR
from epv_env.plant.simulate import energised, simulate
from tests.reference.hybrid_automaton import COMPILED_RIGHT_HAND_SIDES
from tests.reference.numpy_rhs import numpy_rates

CALIBRATED = Parameters.calibrated()
WITH_CONE = Parameters.nominal().replace(a1=0.05)


def random_states(n, seed=0):
    """n states and inputs spread over all that the valve can be in, pressures in any order."""
    rng = np.random.default_rng(seed)
    state = State(
        p2=rng.uniform(0.8e5, 13e5, n), p3=rng.uniform(0.8e5, 13e5, n),
        xPV=rng.uniform(0, 2e-3, n), vPV=rng.normal(0, 1, n),
        xMV=rng.uniform(0, 5e-4, n), vMV=rng.normal(0, 1, n),
        I=rng.uniform(-0.1, 0.7, n), p1=rng.uniform(0.8e5, 13e5, n),
        air_in_PV=np.zeros(n), air_in_MV=np.zeros(n), air_vented=np.zeros(n),
        coil_energy=np.zeros(n),
    )  # fmt: skip
    inputs = Inputs(
        U=rng.uniform(0, 32, n),
        sigma_S=rng.uniform(0, 5e-3, n),
        p1_slope=rng.normal(0, 1e5, n),
        refill=rng.uniform(0, 1e-2, n),
    )
    state = State(*np.broadcast_arrays(*state))
    return state, Inputs(*np.broadcast_arrays(*inputs))


@pytest.mark.parametrize("p", [CALIBRATED, WITH_CONE], ids=["nominal kernel", "extended kernel"])
def test_compiled_derivative_agrees_with_equations_typed_independently(p):
    state, inputs = random_states(1000)
    reservoir = 0.08
    expected = np.array([*(columns := numpy_rates(state, inputs, p, reservoir))[0], *columns[1:]])
    c, e = coefficients(p, reservoir), effect_constants(p)
    right_hand_side = COMPILED_RIGHT_HAND_SIDES[p is WITH_CONE]
    found = np.stack(
        [
            right_hand_side(np.array(q), np.array(u), c, e, 1.0, 1.0)
            for q, u in zip(np.array(state).T.copy(), np.array(inputs).T.copy(), strict=True)
        ],
        axis=1,
    )
    scale = np.maximum(np.max(np.abs(expected), axis=1, keepdims=True), 1e-9)
    assert np.max(np.abs(found - expected) / scale) < 2 * MAX_RELATIVE_ERROR


def test_no_effects_make_the_extended_kernel_the_nominal_one():
    state, inputs = random_states(100, seed=1)
    c, e = coefficients(CALIBRATED), effect_constants(CALIBRATED)
    for q, u in zip(np.array(state).T.copy(), np.array(inputs).T.copy(), strict=True):
        nominal = COMPILED_RIGHT_HAND_SIDES[False](q, u, c, e, 1.0, 1.0)
        extended = COMPILED_RIGHT_HAND_SIDES[True](q, u, c, e, 1.0, 1.0)
        np.testing.assert_allclose(extended, nominal, rtol=1e-13, atol=1e-12 * np.max(np.abs(nominal)))


def test_coil_current_rises_exponentially_while_the_armature_is_held():
    p, U = CALIBRATED, 12.0  # too little to lift the armature
    rest = energised(p, p1=12e5, p2=6e5, U=0.0)._replace(p3=p["p_env"], xMV=0.0)
    run = simulate(p, initial=rest, U=np.full(60, U), period=0.5e-3, step=25e-6)
    gap_reluctance = 1 / (p["mu0"] * np.pi / 4 * p["dMB"] ** 2)
    inductance = p["N"] ** 2 / (p["RML"] + p["xMVmax"] * gap_reluctance)
    expected = U / p["R"] * -np.expm1(-run.time * p["R"] / inductance)
    np.testing.assert_allclose(run.state.I, expected, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(run.state.xMV, 0.0)


@numba.njit
def _magnet(q, u, c, e):
    inverse_Rm = reluctance_inverse(q, c)
    return (current_rate(q, u, c, inverse_Rm, e, False), armature_force(q, c, inverse_Rm, e, False))


def _magnet_powers(p, q, u, printed):
    """Electrical power in, Ohmic heat, rate of stored energy, mechanical power of the magnet [W].

    printed: with the signs of eqs 11 and 12 as they stand in the report.
    """
    gap_reluctance = 1 / (p["mu0"] * np.pi / 4 * p["dMB"] ** 2)
    if printed:
        reluctance = p["RML"] + q.xMV * gap_reluctance
        reluctance_rate = q.vMV * gap_reluctance
        force = p["N"] ** 2 * q.I**2 / (2 * reluctance**2) * gap_reluctance
        current = (u.U - p["R"] * q.I) * reluctance / p["N"] ** 2 + (
            q.I * q.vMV * gap_reluctance / reluctance
        )
    else:
        reluctance = p["RML"] + (p["xMVmax"] - q.xMV) * gap_reluctance
        reluctance_rate = -q.vMV * gap_reluctance
        c, e = Coefficients(*coefficients(p)[:, 0]), Effects(*effect_constants(p)[:, 0])
        current, net_force = _magnet(q, u, c, e)
        force = net_force + p["cMV"] * (q.xMV + p["xMV0"]) + p["kMV"] * q.vMV
    stored = p["N"] ** 2 * (  # of N^2 I^2 / (2 Rm)
        q.I * current / reluctance - q.I**2 * reluctance_rate / (2 * reluctance**2)
    )
    return np.array([u.U * q.I, p["R"] * q.I**2, stored, force * q.vMV])


MOVING = State(
    p2=6e5, p3=9e5, xPV=0.0, vPV=0.0, xMV=2e-4, vMV=0.4, I=0.35, p1=12e5,
    air_in_PV=0.0, air_in_MV=0.0, air_vented=0.0, coil_energy=0.0,
)  # fmt: skip
ON = Inputs(U=24.0, sigma_S=0.0, p1_slope=0.0, refill=0.0)


@pytest.mark.parametrize("printed", [False, True])
def test_magnet_conserves_energy_and_as_printed_would_create_it(printed):
    electrical, heat, stored, mechanical = _magnet_powers(CALIBRATED, MOVING, ON, printed)
    assert mechanical > 0.1
    expected = -mechanical if printed else mechanical
    assert electrical - heat - stored == pytest.approx(expected, rel=1e-9)


def _force(p, q, extended):
    c, e = Coefficients(*coefficients(p)[:, 0]), Effects(*effect_constants(p)[:, 0])
    return piston_force(q, c, e, True if extended else None)


def test_piston_balances_at_the_control_pressure_of_a_hand_calculation():
    p = CALIBRATED
    back, seat = np.pi / 4 * p["d1"] ** 2, np.pi / 4 * p["d2"] ** 2
    spring = p["cPV"] * (1e-3 + p["xPV0"])
    p3 = 12e5 - ((12e5 - 6e5) * seat + spring) / back
    balanced = MOVING._replace(xPV=1e-3, p3=p3)
    assert _force(p, balanced, False) == pytest.approx(0.0, abs=1e-10 * spring)
    assert _force(p, balanced._replace(p3=p3 + 100.0), False) == pytest.approx(-100.0 * back)
    assert _force(p, balanced._replace(vPV=1.0), False) == pytest.approx(-p["kPV"])


def test_cone_narrows_the_seat_as_in_eq_15():
    p, q = Parameters.nominal().replace(a1=0.03), MOVING._replace(xPV=1.5e-3)
    k = p["kappa"]
    drop = 1 - (q.p2 / q.p1) ** ((k - 1) / k)
    gas_speed = np.sqrt(2 * k / (k - 1) * p["R_gas"] * p["T_env"] * drop)
    narrowed = p["d2"] - 2 * q.xPV * (p["a1"] + p["a2"] * gas_speed)
    change = -(q.p1 - q.p2) * np.pi / 4 * (narrowed**2 - p["d2"] ** 2)
    assert gas_speed == pytest.approx(325, abs=5)
    assert _force(p, q, True) - _force(p, q, False) == pytest.approx(change, rel=1e-9)


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
