"""The pulse controllers land where they aim, begin in time, and miss if they are told another valve."""

import numpy as np
import pytest

from controllers.pulse import AdaptivePulse, InformedPulse, PulsePlan
from controllers.pulse_table import nominal_table, time_to_open
from epv_env.common.units import BAR
from epv_env.observation import LAYOUT, encode
from epv_env.plant.plantfile import Plant
from training.evaluation.rollout import begin_episodes, make_env, run_episodes

pytestmark = pytest.mark.training
PLANT = Plant.calibrated()
EPISODES = 24
SEEDS = list(range(16))
PERIOD_WORTH = 0.28
"""Most that one more period adds to a pulse of these tests [bar]."""
USUAL = PulsePlan(trigger=-0.1, aim=0.05, caution=0.0, doubt=0.0, look_ahead=1.0, rounding=0.5)


def landed(plan: PulsePlan, *, told_another: bool = False) -> np.ndarray:
    """p2 - aim after the first pulse of episodes without consumption and noise [bar]."""
    pulse = InformedPulse(pulse=plan, filter_time=0.01)
    env = make_env(pulse, EPISODES, scenario="none", sensor_noise=False, drop_bar=(0.15, 0.6), threads=1)
    observation = begin_episodes(env, pulse, list(range(EPISODES)))
    if told_another:
        narrow = {"parameters": {"alphaPV": 0.7 * PLANT.parameters["alphaPV"]}}
        other = make_env(pulse, EPISODES, threads=1, **narrow)
        begin_episodes(other, pulse, list(range(EPISODES)))
    for _ in range(50):
        observation = env.task.step(*env.action.decode(pulse.act(observation))).observation
    return env.task.valves.state.p2 / BAR - env.task.target - plan.aim


def test_a_pulse_lands_at_its_aim_to_within_half_a_period():
    missed = landed(USUAL)
    assert np.max(np.abs(missed)) < 0.55 * PERIOD_WORTH
    assert abs(np.mean(missed)) < 0.1 * PERIOD_WORTH


def test_rounding_down_never_exceeds_the_aim():
    assert np.max(landed(USUAL._replace(rounding=1.0, trigger=-0.3))) < 0.03


def test_the_check_can_fail_a_controller_that_is_told_another_valve_misses():
    assert np.mean(landed(USUAL, told_another=True)) > 0.25 * PERIOD_WORTH


def observe(error, p3=11.0):
    """One observation at rest, p1 = 11 bar, the coil on, with a given p2 - target [bar]."""
    values = {quantity.name: np.full(1, quantity.centre) for quantity in LAYOUT}
    given = {"p1": 11.0, "p3": p3, "p2_error": error, "action": 1.0}
    return encode(values | {name: np.full(1, value) for name, value in given.items()})


def begins_at(plan: PulsePlan, p3: float = 11.0) -> float:
    """p2 - target at which the coil is first switched off while p2 falls by 2 bar/s."""
    pulse = AdaptivePulse(plant=PLANT, pulse=plan, filter_time=0.01)
    pulse.reset(1)
    for error in np.arange(0.3, -0.3, -0.01):
        if pulse.act(observe(error, p3))[0] == 0:
            return float(error)
    return -np.inf


def test_a_pulse_begins_before_the_trigger_by_what_is_consumed_while_the_chamber_vents():
    assert begins_at(USUAL._replace(look_ahead=0.0)) == pytest.approx(-0.1, abs=0.011)
    table = nominal_table(PLANT)
    vents = time_to_open(table, 0, 0.0, 11.0, 8.0, 11.0)
    foreseen = -0.1 + 2.0 * (vents + table.release_lag[0])
    assert begins_at(USUAL) == pytest.approx(foreseen, abs=0.015)


def test_it_begins_later_where_p3_is_low_already():
    assert begins_at(USUAL, p3=7.5) < begins_at(USUAL) - 0.05


def rms(controller, parameters):
    options = {"parameters": parameters, "scenario": "steps"}
    metrics = run_episodes(controller, seeds=SEEDS, duration=5.0, options=options)
    return np.sqrt(np.mean(metrics.rms_bar**2))


def test_on_another_valve_learning_beats_believing_the_nominal_one():
    soft = {"cPV": 0.9 * PLANT.parameters["cPV"], "xPV0": 0.9 * PLANT.parameters["xPV0"]}

    nominal = AdaptivePulse(plant=PLANT)  # believes that every valve is the nominal one
    nominal.constants = nominal.constants._replace(informed=True)
    assert rms(AdaptivePulse(plant=PLANT), soft) < 0.9 * rms(nominal, soft)


def test_knowing_the_valve_is_worth_something():
    adaptive, informed = (
        rms(controller, "sensitive_ten_percent")
        for controller in (AdaptivePulse(plant=PLANT), InformedPulse())
    )
    assert informed < adaptive


def test_a_trigger_above_the_aim_is_refused():
    with pytest.raises(ValueError, match="trigger < aim"):
        AdaptivePulse(plant=PLANT, pulse=USUAL._replace(trigger=0.1))
