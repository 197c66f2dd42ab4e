"""Other forms: the plant's own without their effect and where both laws agree, others elsewhere."""

import numpy as np
import pytest

from epv_env.plant.coefficients import coefficients
from epv_env.plant.effects.magnet import saturated_force
from epv_env.plant.effects.registry import effect_constants
from epv_env.plant.equations import Inputs, State
from epv_env.plant.parameters import Parameters
from identification.bench.hybrid_automaton import COMPILED_RIGHT_HAND_SIDES
from identification.studies.blind.bench_rates import right_hand_side
from identification.studies.blind.effect_draws import top_sizes
from identification.studies.blind.other_forms import (
    INSTANT_DROP,
    LANGEVIN,
    OTHER_FORMS,
    langevin,
    langevin_force,
    langevin_slope,
    level_of_force,
)

PLANT = COMPILED_RIGHT_HAND_SIDES[True]
DROP, CURRENT = (State._fields.index(name) for name in ("supply_drop", "I"))
LEVELS = (1e-3, 0.02, 0.03, 0.2, 1.0, 3.0)


def top(name):
    return Parameters.calibrated().replace(**top_sizes(name))


def state(**changed):
    """A valve that fills its circuit, energised, its armature on the way."""
    usual = State(
        p2=6e5, p3=4e5, xPV=1e-3, vPV=0.1, xMV=2e-4, vMV=0.2, I=0.3, p1=11e5,
        air_in_PV=0.0, air_in_MV=0.0, air_vented=0.0, coil_energy=0.0,
    )  # fmt: skip
    return usual._replace(**changed)


def rates(function, p, q):
    c, e = coefficients(p), effect_constants(p)
    return function(np.array(q, float), np.array(Inputs(24.0, 0.0, 0.0, 0.0), float), c, e, 1.0, 1.0)


@pytest.mark.parametrize("name", OTHER_FORMS)
def test_without_the_effect_the_other_form_is_the_plant(name):
    p = Parameters.calibrated()
    np.testing.assert_allclose(
        rates(right_hand_side(0.0, [name]), p, state()), rates(PLANT, p, state()), rtol=1e-12
    )


@pytest.mark.parametrize("name", OTHER_FORMS)
def test_with_the_effect_the_other_form_is_another(name):
    other, fitted = (
        rates(right_hand_side(0.0, [name]), top(name), state()),
        rates(PLANT, top(name), state()),
    )
    assert np.max(np.abs(other - fitted) / np.maximum(np.abs(fitted), 1e-9)) > 0.01


def test_an_instant_drop_is_the_plant_s_once_that_has_settled():
    """The plant's own drop, run to rest at this flow, gives the rates of the instant one."""
    p = top(INSTANT_DROP)
    instant = rates(right_hand_side(0.0, [INSTANT_DROP]), p, state())
    low, high = 0.0, state().p1 / 3
    for _ in range(60):
        middle = 0.5 * (low + high)
        falls = rates(PLANT, p, state(supply_drop=middle))[DROP] < 0
        low, high = (low, middle) if falls else (middle, high)
    assert low > 1e4
    settled = rates(PLANT, p, state(supply_drop=low))
    settled[DROP] = 0.0
    np.testing.assert_allclose(instant, settled, rtol=1e-9)


def test_an_instant_drop_has_no_state_and_a_flow_back_no_drop():
    p = top(INSTANT_DROP)
    function = right_hand_side(0.3, [INSTANT_DROP])
    np.testing.assert_array_equal(
        rates(function, p, state()), rates(function, p, state(supply_drop=5e4))
    )
    back = state(p1=5e5, p2=6e5, p3=6e5)
    np.testing.assert_allclose(
        rates(function, p, back), rates(right_hand_side(0.3), Parameters.calibrated(), back), rtol=1e-12
    )


def test_the_langevin_curve_is_linear_iron_at_first_and_saturates_at_the_same_flux():
    """At a level of 1e-3 both forces are that of linear iron; far beyond, the flux is 1/sMV."""
    assert langevin_force(1e-3) == pytest.approx(0.5, rel=1e-5)
    assert langevin_slope(1e-3) == pytest.approx(1.0, rel=1e-5)
    assert langevin(3 * 1e4) == pytest.approx(1.0, rel=1e-4)


@pytest.mark.parametrize("u", LEVELS)
def test_slope_and_force_are_derivatives_of_flux_and_coenergy(u):
    """With k = N I sMV and u = k/Rm: flux L(3u), force d(Rm G(u))/d(-Rm), G the flux's integral."""
    h = 1e-4 * u
    levels = np.linspace(0.0, u + h, 20001)[1:]
    flux = np.array([langevin(3 * level) for level in (u - h, u + h)])
    assert langevin_slope(u) == pytest.approx((flux[1] - flux[0]) / (2 * h), rel=1e-4)
    curve = np.concatenate([[0.0], 1 / np.tanh(3 * levels) - 1 / (3 * levels)])
    at = np.concatenate([[0.0], levels])
    coenergy = np.interp(
        u, at, np.concatenate([[0.0], np.cumsum(np.diff(at) * (curve[1:] + curve[:-1]) / 2)])
    )
    assert langevin_force(u) == pytest.approx((u * langevin(3 * u) - coenergy) / u**2, rel=1e-3)


@pytest.mark.parametrize("u", LEVELS)
def test_the_fitted_curve_s_force_is_met(u):
    assert saturated_force(level_of_force(u)) == pytest.approx(langevin_force(u), rel=1e-9)


def test_the_armature_s_force_and_the_current_s_rate_are_those_of_the_langevin_curve():
    p, q = top(LANGEVIN), state(vMV=0.0)
    gap = 1.0 / (p["mu0"] * np.pi / 4 * p["dMB"] ** 2)
    Rm = p["RML"] + (p["xMVmax"] - q.xMV) * gap
    u = p["sMV"] * p["N"] * q.I / Rm
    linear = rates(PLANT, Parameters.calibrated(), q)
    found = rates(right_hand_side(0.0, [LANGEVIN]), p, q)
    pull = (langevin_force(u) - 0.5) * (p["N"] * q.I / Rm) ** 2 * gap
    assert found[-1] - linear[-1] == pytest.approx(pull, rel=1e-9)
    assert found[CURRENT] / linear[CURRENT] == pytest.approx(1 / langevin_slope(u), rel=1e-9)


def test_an_effect_without_another_form_is_refused():
    with pytest.raises(ValueError, match="flow_force has no other form"):
        right_hand_side(0.0, ["flow_force"])
