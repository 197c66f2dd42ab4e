"""The evaluation's scenarios are what their names say, and can be controlled."""

import numpy as np
import pytest

pytest.importorskip("pandas")

from controllers.hysteresis import Hysteresis
from epv_env.common.units import BAR
from epv_env.plant.effects.registry import CATALOGUE
from epv_env.plant.plantfile import Plant
from epv_env.reward import REFERENCE_PERIOD
from epv_env.settings import make_settings
from training.evaluation.rollout import begin_episodes, make_env, run_episodes
from training.evaluation.scenarios import (
    BEYOND,
    EVALUATION,
    LEVELS,
    REFILL_TIME,
    SENSOR_FAULTS,
    TUNING_REGION,
    VENTED_DROP_BAR,
    effect_levels,
    worn_scenarios,
)

pytestmark = pytest.mark.training


def settings(name):
    return make_settings(Plant.calibrated(), control_period=0.005, **EVALUATION[name].options)


def test_the_environment_accepts_every_scenario():
    for name, scenario in {**EVALUATION, **BEYOND, **SENSOR_FAULTS, **worn_scenarios()}.items():
        assert " at 0x" not in repr(scenario)  # the subject of a journal: an address would begin it anew
        options = {"control_period": REFERENCE_PERIOD, "parameters": TUNING_REGION, **scenario.options}
        assert make_settings(Plant.calibrated(), **options).control_period > 0, name


class Always(Hysteresis):
    """Keeps the coil on, which shuts the valve, or off, which opens it."""

    def __init__(self, on: bool):
        super().__init__(open_below=-0.1, shut_above=0.0)
        self.on = on

    def act(self, observations):
        return np.full(len(observations), int(self.on))


def test_an_open_valve_refills_within_the_settling_time():
    options = {
        "parameters": TUNING_REGION, "drop_bar": (4.4, 4.4), "scenario": "none",
        "settling_time": REFILL_TIME,
    }  # fmt: skip
    metrics = run_episodes(Always(on=False), seeds=list(range(16)), duration=2.0, options=options)
    assert np.all(metrics.breakdown_bar < 0.5)


def highest_error(controller, duration, **options):
    """Highest p2 of an episode, less its target [bar]."""
    env = make_env(controller, 1, parameters=TUNING_REGION, **options)
    observation, p2 = begin_episodes(env, controller, [0]), []
    for _ in range(round(duration / env.unwrapped.settings.control_period)):
        observation = env.advance(controller.act(observation)).observation
        p2.append(env.task.valves.state.p2[0] / BAR)
    return max(p2) - env.task.target[0]


@pytest.mark.parametrize(("drop", "avoidable"), [(VENTED_DROP_BAR[0], True), (0.3, False)])
def test_a_vented_valve_can_be_shut_in_time_only_from_far_below(drop, avoidable):
    options = {"p3_bar": (1.0, 1.0), "drop_bar": (drop, drop), "scenario": "none"}
    assert (highest_error(Always(on=True), 1.5, **options) < 0.5) == avoidable


def test_a_starved_circuit_reaches_its_band_once_refilled_and_not_before():
    controller = Hysteresis(open_below=0.0, shut_above=0.0)
    for duration, reached in ((2.9, False), (4.5, True)):
        assert (highest_error(controller, duration, **BEYOND["starved"].options) > -0.5) == reached


def test_every_effect_is_there_at_growing_sizes():
    found: dict[str, dict[str, dict[str, float]]] = {}
    for name, level, sizes in effect_levels():
        found.setdefault(name, {})[level] = sizes
    assert {name.split(" ")[0] for name in found} == set(CATALOGUE)
    assert len(worn_scenarios()) == len(found)
    for levels in found.values():
        assert tuple(levels) == LEVELS
        for symbol in set(levels["top"]) - {"A_pipe"}:
            sizes = [abs(levels[level][symbol]) for level in LEVELS]
            assert 0 < sizes[0] < sizes[1] < sizes[2]
