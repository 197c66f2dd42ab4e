"""The evaluation's scenarios are what their names say, and can be controlled."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("pandas")

from controllers.hysteresis import Hysteresis
from epv_env.plant.consumption import SCENARIOS, Profiles, Scenario, draw_profile
from epv_env.plant.plantfile import Plant
from epv_env.settings import make_settings
from epv_env.signals import RecordedConsumption
from training.evaluation.rollout import run_episodes
from training.evaluation.scenarios import EVALUATION, NAMED, RANDOM

pytestmark = pytest.mark.training

CONTROLLER = Hysteresis(open_below=-0.1, shut_above=0.0, shut_lookahead=0.03)
TIME = np.arange(0.0, 10.0, 0.005)


def settings(name):
    return make_settings(Plant.calibrated(), control_period=0.005, **EVALUATION[name].options)


def flow(name, seed=0):
    """Consumption over 10 s [g/s]."""
    profiles = Profiles(1)
    scenario = settings(name).scenario
    assert not isinstance(scenario, RecordedConsumption)
    profiles.start(0, draw_profile(scenario, np.random.default_rng(seed)))
    return np.array([1e3 * profiles.mean_flow(np.array([t]), 0.005)[0] for t in TIME])


def test_there_are_a_dozen_and_a_random_one():
    assert len(NAMED) >= 12
    assert set(EVALUATION) == {RANDOM, *NAMED}
    assert all(scenario.meaning for scenario in EVALUATION.values())


@pytest.mark.parametrize("name", EVALUATION)
def test_every_scenario_runs(name):
    metrics, _ = run_episodes(CONTROLLER, seeds=[1, 2], duration=0.05, options=EVALUATION[name].options)
    assert len(metrics) == 2


def test_one_emergency_is_one():
    drawn = flow("one emergency")
    assert np.sum(np.diff(drawn > 1.0) == 1) == 2  # it begins, it ends
    assert 5.0 <= drawn.max() <= 5.5


def test_the_anti_lock_is_faster_than_anything_in_training():
    def bursts(drawn):
        return np.sum((drawn[1:] > 1.0) & (drawn[:-1] <= 1.0))

    fastest = max(bursts(flow("pumping", seed)) for seed in range(3))
    assert min(bursts(flow("anti-lock", seed)) for seed in range(3)) > fastest


def test_the_staircase_never_pauses():
    drawn = flow("staircase")
    first = np.argmax(drawn > 0)
    assert np.all(drawn[first:] > 0.49)


def test_without_the_compressor_the_reservoir_only_sags():
    supply = settings("compressor off").supply
    assert supply.delivery == 0.0
    assert supply.volume < settings(RANDOM).supply.volume


def test_a_scenario_of_ones_own_is_drawn_like_a_named_one():
    own = replace(SCENARIOS["steps"], meaning="mine")
    assert isinstance(own, Scenario)
    ours, named = (draw_profile(each, np.random.default_rng(3)) for each in (own, "steps"))
    np.testing.assert_array_equal(ours.applications, named.applications)
