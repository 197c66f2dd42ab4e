"""The valve learner finds out which valve it has: from synthetic pulses, and from those of the plant."""

import numpy as np
import pytest

from controllers import valve_learner
from controllers.pulse import AdaptivePulse
from controllers.pulse_table import AGE, HARDEST_FLOW, PulseTable, nominal_table
from controllers.valve_learner import (
    FILTER_TIME,
    GAIN_READING_ERROR,
    GAIN_SPREAD,
    MOST_RESERVE,
    OFFSET_SPREAD,
    TOLERATED,
    VALVE,
)
from epv_env.common.units import BAR
from epv_env.observation import ENTRIES, READINGS, read
from epv_env.plant.plantfile import Plant
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves
from training.evaluation.rollout import make_env

pytestmark = pytest.mark.training
PLANT = Plant.calibrated()


@pytest.fixture(scope="module")
def table():
    return nominal_table(PLANT)


def unknown(n: int = 1):
    """Records of valves of which nothing is known."""
    valves = np.zeros(n, VALVE)
    for valve in valves:
        valve_learner.begin(valve, False)
    return valves


def test_before_any_pulse_the_nominal_valve_is_expected():
    valves = unknown(3)
    np.testing.assert_allclose(valves["offset"], 0.0, atol=1e-12)
    np.testing.assert_allclose(valves["gain"], 1.0)
    np.testing.assert_allclose(valves["gain_deviation"], GAIN_SPREAD)
    np.testing.assert_allclose(valves["offset_deviation"], OFFSET_SPREAD, rtol=0.02)
    assert np.all(valves["early_offset"] == pytest.approx(2.33 * OFFSET_SPREAD, abs=0.1))


def ramp_table(table: PulseTable) -> PulseTable:
    """A table by which p2 rises by 0.4 bar for each bar that p3 lies below the opening pressure."""
    opening = 7.0
    log = np.log(1.05) - AGE * table.vent_rate[0]
    depth = np.maximum(opening - opening * np.exp(log), 0.0)
    return table._replace(gain=np.broadcast_to(0.4 * depth[:, None], table.gain.shape).copy())


@pytest.mark.parametrize(("offset", "gain"), [(0.6, 1.2), (-0.3, 0.8)])
def test_pulses_tell_opening_pressure_and_gain(table, offset, gain):
    """Twin experiment: synthetic pulses of a valve with this offset [bar] and gain."""
    ramp, rng = ramp_table(table), np.random.default_rng(0)
    (record,) = unknown()
    first = float(record["offset_deviation"])
    for _ in range(60):
        record["end_p1"], record["end_p2"], record["end_p3"] = 11.0, 8.0, rng.uniform(5.8, 7.2)
        at = (float(record[f"end_{name}"]) for name in ("p1", "p2", "p3"))
        rise = gain * valve_learner.gained_at_once(ramp, 0, offset, *at)
        valve_learner.learn_pulse(record, ramp, 0, rise + rng.normal(0.0, GAIN_READING_ERROR), 0.01)
    valve_learner.summarise(record)
    assert record["offset"] == pytest.approx(offset, abs=0.2)
    assert record["gain"] == pytest.approx(gain, abs=0.2)
    assert record["offset_deviation"] < 0.5 * first


def test_a_rise_before_the_expected_opening_tells_of_a_higher_opening_pressure(table):
    first, second = unknown(2)
    opening = valve_learner.opens_at(table, 0, 11.0, 8.0)
    for _ in range(5):
        valve_learner.watch_opening(first, table, 0, 11.0, 8.0, opening + 0.5, 0.15)
    for valve in (first, second):
        valve_learner.summarise(valve)
    assert first["offset"] > 0.5
    assert second["offset"] == pytest.approx(0.0, abs=1e-12)


def controlled(parameters, *, episodes=16, periods=600, **options):
    """The learner of an adaptive pulse controller after episodes on these plants, and their task."""
    pulse = AdaptivePulse(plant=PLANT)
    env = make_env(pulse, episodes, parameters=parameters, scenario="steps", threads=1, **options)
    observation, _ = env.reset(seed=list(range(episodes)))
    pulse.reset(episodes)
    for _ in range(periods):
        observation = env.task.step(*env.action.decode(pulse.act(observation))).observation
    return pulse.memory, env.task


def test_on_the_plant_it_finds_a_soft_spring_and_a_wide_exhaust():
    nominal = PLANT.parameters
    soft, _ = controlled({"cPV": 0.9 * nominal["cPV"], "xPV0": 0.9 * nominal["xPV0"]})
    piston = np.pi / 4 * nominal["d1"] ** 2
    expected = (1 - 0.81) * nominal["cPV"] * nominal["xPV0"] / piston / BAR
    assert np.median(soft["offset"]) == pytest.approx(expected, abs=0.15)
    wide, _ = controlled({"alphaMV": 1.1 * nominal["alphaMV"]})
    assert np.median(wide["pace"]) == pytest.approx(1.1, abs=0.04)
    small, _ = controlled({"V2": 0.8 * nominal["V2"]})
    assert np.median(small["gain"]) == pytest.approx(1.25, abs=0.12)


def test_a_batch_is_learnt_as_its_valves_alone_to_the_bit():
    together, _ = controlled("sensitive_ten_percent", episodes=3, periods=200)
    env_seed_two, _ = controlled("sensitive_ten_percent", episodes=1, periods=200)
    assert together[0].tobytes() == env_seed_two[0].tobytes()


def test_the_reserve_is_what_the_hardest_application_draws_beyond_what_is_tolerated(table):
    """From rest, with the hardest application as the coil is switched off, until the piston lifts."""
    p1, p2, step = 11.0 * BAR, 8.0 * BAR, 0.1e-3
    nominal = PLANT.parameters
    valves = Valves.started(1, nominal, energised(nominal, p1=p1, p2=p2, U=24.0), threads=1)
    valves.inputs.sigma_S[:] = HARDEST_FLOW
    while valves.state.xPV[0] == 0:
        valves.advance(step)
    fell = (p2 - valves.state.p2[0]) / BAR
    rest = valve_learner.time_to_open(table, 0, 0.0, p1 / BAR, p2 / BAR - fell, p1 / BAR)
    assert table.hardest_fall[0] * (table.release_lag[0] + rest) == pytest.approx(fell, rel=0.03)

    slow = table._replace(vent_rate=table.vent_rate / 10)
    (known,), (readings,) = np.zeros(1, VALVE), np.zeros(1, READINGS)
    read(readings, np.zeros(ENTRIES))
    valve_learner.observe(known, slow, 0, readings, 5e-3, FILTER_TIME, False)
    assert known["reserve"] == MOST_RESERVE
    assert table.hardest_fall[0] * known["opens_from_rest"] > TOLERATED
