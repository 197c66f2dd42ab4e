"""The bench's forms: the plant's own without deviation or effect, others with them."""

import numpy as np
import pytest

from docs.studies.blind.forms import (
    LANGEVIN,
    OTHER_FORMS,
    _rates_and_forces,
    langevin_force,
    langevin_slope,
    right_hand_side,
)
from docs.studies.blind.truth import top_sizes
from epv_env.plant.coefficients import coefficients
from epv_env.plant.effects.registry import EFFECTS as RECORDS
from epv_env.plant.effects.registry import effect_constants
from epv_env.plant.equations import Inputs, State
from epv_env.plant.parameters import Parameters
from tests.reference.hybrid_automaton import COMPILED_RIGHT_HAND_SIDES

PLANT = COMPILED_RIGHT_HAND_SIDES[True]
CURRENT = State._fields.index("I")


def largest(record):
    """The greatest drawn sizes of an effect by symbol."""
    return {size.symbol: size.drawn[1] for sizes in record.drawn for size in sizes}


def states(warm=0.0):
    """States in the strokes, moving, with every state of an effect but the winding's away from rest."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        yield State(
            p2=rng.uniform(4e5, 8e5), p3=rng.uniform(2e5, 11e5), xPV=rng.uniform(1e-5, 2e-3),
            vPV=rng.normal(0, 0.2), xMV=rng.choice([1e-5, 4.9e-4]), vMV=rng.normal(0, 0.3),
            I=rng.uniform(0.05, 0.5), p1=rng.uniform(9e5, 12e5), air_in_PV=0.0, air_in_MV=0.0,
            air_vented=0.0, coil_energy=0.0, coil_heat=warm, heat_3=-0.05, heat_2=0.02,
            far_pressure=-3e4, supply_drop=3e4, lag_2=4e3, lag_3=-6e3,
        )  # fmt: skip


def at(function, p):
    """Rates and forces of a valve as a function of its state and the coil's voltage."""
    c, e = coefficients(p), effect_constants(p)
    return lambda q, U: function(
        np.array(q, float), np.array(Inputs(U, 0.0, 0.0, 0.0), float), c, e, 1.0, 1.0
    )


def all_rates(function, p, warm=0.0):
    """Rates and forces with the coil on and off, (states, rows)."""
    found = at(function, p)
    return np.array([found(q, U) for q in states(warm) for U in (0.0, 18.9)])


def uncompiled(y, u, c, e, free_PV, free_MV):
    """The forms in Python without deviation, in milliseconds."""
    return _rates_and_forces.py_func(y, u, c, e, free_PV, free_MV, 0.0, False, False)


@pytest.mark.parametrize(
    "forms", [uncompiled, pytest.param(right_hand_side(0.0), marks=pytest.mark.slow)]
)
def test_without_deviation_the_forms_are_the_plant_s(forms):
    sizes = {symbol: size for record in RECORDS for symbol, size in largest(record).items()}
    p = Parameters.calibrated().replace(**sizes)
    plant = PLANT.py_func if forms is uncompiled else PLANT
    np.testing.assert_allclose(
        all_rates(forms, p, 20.0), all_rates(plant, p, 20.0), rtol=1e-12, atol=1e-12
    )


def top(name):
    return Parameters.calibrated().replace(**top_sizes(name))


def state(**changed):
    """A valve that fills its circuit, energised, its armature on the way."""
    usual = State(
        p2=6e5, p3=4e5, xPV=1e-3, vPV=0.1, xMV=2e-4, vMV=0.2, I=0.3, p1=11e5,
        air_in_PV=0.0, air_in_MV=0.0, air_vented=0.0, coil_energy=0.0,
    )  # fmt: skip
    return usual._replace(**changed)


@pytest.mark.slow
@pytest.mark.parametrize("name", OTHER_FORMS)
def test_the_other_form_is_the_plant_without_the_effect_and_another_with_it(name):
    other = right_hand_side(0.0, [name])
    p = Parameters.calibrated()
    np.testing.assert_allclose(at(other, p)(state(), 24.0), at(PLANT, p)(state(), 24.0), rtol=1e-12)
    found, fitted = (at(function, top(name))(state(), 24.0) for function in (other, PLANT))
    assert np.max(np.abs(found - fitted) / np.maximum(np.abs(fitted), 1e-9)) > 0.01


@pytest.mark.slow
def test_the_armature_s_force_and_the_current_s_rate_are_those_of_the_langevin_curve():
    p, q = top(LANGEVIN), state(vMV=0.0)
    gap = 1.0 / (p["mu0"] * np.pi / 4 * p["dMB"] ** 2)
    Rm = p["RML"] + (p["xMVmax"] - q.xMV) * gap
    u = p["sMV"] * p["N"] * q.I / Rm
    linear = at(PLANT, Parameters.calibrated())(q, 24.0)
    found = at(right_hand_side(0.0, [LANGEVIN]), p)(q, 24.0)
    pull = (langevin_force(u) - 0.5) * (p["N"] * q.I / Rm) ** 2 * gap
    assert found[-1] - linear[-1] == pytest.approx(pull, rel=1e-9)
    assert found[CURRENT] / linear[CURRENT] == pytest.approx(1 / langevin_slope(u), rel=1e-9)
