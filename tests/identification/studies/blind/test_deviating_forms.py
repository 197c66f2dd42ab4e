"""The bench's forms: the plant's own without deviation, others with it."""

import numpy as np
import pytest

from epv_env.plant.coefficients import coefficients
from epv_env.plant.effects.registry import EFFECTS as RECORDS
from epv_env.plant.effects.registry import effect, effect_constants
from epv_env.plant.equations import Inputs, State
from epv_env.plant.parameters import Parameters
from identification.bench.hybrid_automaton import COMPILED_RIGHT_HAND_SIDES
from identification.studies.blind.bench_rates import right_hand_side, terminal_currents
from identification.studies.blind.truth import EFFECTS

BESIDE_THE_STATE = {"pressure_sensor_bias", "current_sensor_gain", "command_delay"}
"""Effects that act before or behind the equations of state (tests of the bench)."""


def largest(record):
    """The greatest drawn sizes of an effect by symbol."""
    return {size.symbol: size.drawn[1] for sizes in record.drawn for size in sizes}


SIZES = {symbol: size for record in RECORDS for symbol, size in largest(record).items()}


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


def rates(function, p, warm=0.0):
    """Rates and forces with the coil on and off, (states, rows)."""
    c, e = coefficients(p), effect_constants(p)
    return np.array(
        [
            function(np.array(q), np.array(Inputs(U, 0.0, 0.0, 0.0), float), c, e, 1.0, 1.0)
            for q in states(warm)
            for U in (0.0, 18.9)
        ]
    )


def currents(p, deviation):
    """Terminal currents with the coil on."""
    table = np.array([*states()]).T
    inputs = np.repeat(np.array(Inputs(18.9, 0.0, 0.0, 0.0), float)[:, None], table.shape[1], axis=1)
    return terminal_currents(
        np.ascontiguousarray(table), inputs, coefficients(p), effect_constants(p), deviation
    )


def with_effect(name):
    return Parameters.calibrated().replace(**largest(effect(name)))


def test_without_deviation_the_forms_are_the_plant_s():
    p = Parameters.calibrated().replace(**SIZES)
    np.testing.assert_allclose(
        rates(right_hand_side(0.0), p, 20.0), rates(COMPILED_RIGHT_HAND_SIDES[True], p, 20.0), rtol=1e-12
    )


def test_without_effects_there_is_nothing_to_deviate():
    p = Parameters.calibrated()
    np.testing.assert_array_equal(rates(right_hand_side(0.15), p), rates(right_hand_side(0.0), p))
    np.testing.assert_array_equal(currents(p, 0.15), [q.I for q in states()])


@pytest.mark.parametrize("name", [name for name in EFFECTS if name not in BESIDE_THE_STATE])
def test_each_effect_deviates_and_by_a_part_of_itself(name):
    """The deviation moves the rates less than the effect does, where the effect moves them."""
    p, warm = with_effect(name), 20.0 if name == "coil_heating" else 0.0
    off = rates(right_hand_side(0.0), Parameters.calibrated())
    fitted, other = (rates(right_hand_side(d), p, warm) for d in (0.0, 0.1))
    scale = np.max(np.abs(fitted), axis=0) + 1e-30
    deviates = np.max(np.abs(other - fitted) / scale)
    assert deviates > 1e-5
    if name != "armature_bounce":  # which acts in the landings, not in the rates
        assert deviates < 0.5 * np.max(np.abs(fitted - off) / scale)


def test_the_current_that_is_read_deviates_with_the_shorted_turn():
    p = with_effect("eddy_current")
    apart = np.abs(currents(p, 0.1) - currents(p, 0.0))
    whole = np.abs(currents(p, 0.0) - currents(Parameters.calibrated(), 0.0))
    assert 0.05 < np.max(apart) / np.max(whole) < 0.2
