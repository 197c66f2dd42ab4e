"""Conditions beyond the ordinary do what they say, in the single environment and the batch alike."""

from typing import Any

import numpy as np
import pytest

from epv_env.common.units import BAR
from epv_env.conditions import CONDITIONS, PROBABILITIES, Conditions
from epv_env.episode import WORN, Start, under_conditions
from epv_env.observation import INDEX
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant
from epv_env.settings import make_settings
from tests.env.rollouts import actions, assert_same, native, run, side_by_side

PERIOD = 5e-3
DRAWS = 200


def starts(region: Any = "sensitive_ten_percent", **conditions: Any):
    """Episodes' starts under conditions, and the same without."""
    settings = make_settings(Plant.calibrated(), control_period=PERIOD, parameters=region)
    plain = [Start.draw(np.random.default_rng(seed), settings) for seed in range(DRAWS)]
    return [under_conditions(start, Conditions(**conditions)) for start in plain], plain


def observed(name, options, commands, n=2):
    """Entries of the observations after each step (periods, n) [-], and the environment."""
    env = native("EPValve-v0", n, sensor_noise=0.0, **options)
    env.reset(seed=1)
    return np.array([env.step(np.full(n, command))[0][:, INDEX[name]] for command in commands]), env


@pytest.mark.parametrize("identifier", ["EPValve-v0", "EPValvePWM-v0"])
def test_single_and_batch_agree_under_all_conditions(identifier):
    options = {"conditions": dict.fromkeys(PROBABILITIES, 0.5), "max_episode_steps": 40}
    commands = actions(identifier, 5, 90)
    found = run(native(identifier, 5, **options), commands)
    assert_same(found, run(side_by_side(identifier, 5, **options), commands))


def test_a_probability_is_the_share_of_the_episodes():
    for name in PROBABILITIES:
        found, plain = starts(**{name: 0.5})
        changed = sum(a is not b for a, b in zip(found, plain, strict=True))
        assert 70 <= changed <= 130, name  # four standard deviations of 200 coins


def test_a_worn_valve_has_one_to_three_effects_up_to_their_typical_size():
    nominal = Parameters.calibrated()
    mild = {size.symbol: max(map(abs, size.mild)) for sizes in WORN for size in sizes}
    found, _ = starts("exact", worn=1.0)
    seen = set()
    for start in found:
        sizes = {s: v for s, v in start.parameters.items() if v != nominal[s]}
        assert 1 <= len(sizes) <= 6
        assert all(abs(size) <= 1.0001 * mild[symbol] for symbol, size in sizes.items())
        seen |= set(sizes)
    assert seen == set(mild)


def test_a_rest_delays_the_applications_and_nothing_else():
    found, plain = starts(rest=1.0)
    later = np.array([a.consumption.applications[0, 0] for a in found])
    later -= [b.consumption.applications[0, 0] for b in plain]
    assert 2 <= later.min() < 4 < 60 < later.max() <= 120
    for a, b in zip(found, plain, strict=True):
        np.testing.assert_array_equal(a.consumption.applications[1:], b.consumption.applications[1:])


def test_a_frozen_p3_reads_the_same_from_its_time_on():
    options = {"conditions": {"frozen_p3": 1.0, "frozen_p3_s": 0.05}}
    commands = [0] * 30
    frozen, _ = observed("p3", options, commands)
    usual, _ = observed("p3", {}, commands)
    np.testing.assert_array_equal(frozen[:10], usual[:10])
    np.testing.assert_array_equal(frozen[10:], frozen[[9]].repeat(20, 0))
    assert np.all(usual[12] != frozen[12])


def test_the_target_steps_at_the_end_of_its_period():
    options = {
        "target_bar": 7.0,
        "conditions": {"target_steps": 1.0, "target_step_s": 0.048, "target_step_bar": 0.3},
    }  # fmt: skip
    shown, env = observed("target", options, [1] * 60)
    targets = 8.0 + 4.0 * shown[:, 0]
    expected = 7.0 + 0.3 * np.minimum(np.arange(1, 61) * 5e-3 // 0.048, 4)
    np.testing.assert_allclose(targets, expected, atol=1e-5)
    np.testing.assert_allclose(env.unwrapped.task.target, 8.2)


def test_a_starved_supply_is_refilled_within_a_second_and_not_before_its_time():
    options = {"conditions": {"starved": 1.0, "starved_bar": 1.0, "starved_s": 0.5}, "scenario": "none"}
    env = native("EPValve-v0", 4, **options)
    env.reset(seed=1)
    p1 = []
    for _ in range(300):
        env.step(np.ones(4, dtype=int))
        p1.append(env.unwrapped.task.valves.state.p1 / BAR)
    p1 = np.array(p1)
    assert np.all(p1[99] <= env.unwrapped.task.target - 1.0 + 1e-6)
    assert np.all(p1[101] > p1[99])
    assert np.all(p1[-1] >= 12.5)


def test_the_broad_conditions_run_without_losing_a_plant():
    env = native("EPValve-v0", 128, conditions=CONDITIONS["broad"], autoreset_mode="SameStep")
    rollout = run(env, np.ones((200, 128), dtype=int))
    assert all(np.all(np.isfinite(step.reward)) for step in rollout.steps)


def test_extreme_plants_keep_to_the_region_and_gather_at_its_ends():
    found, plain = starts(extreme=1.0)
    boxes = found[0].region.boxes
    low, high = np.transpose(list(boxes.values()))
    moved, usual = (
        (np.array([[start.parameters[symbol] for symbol in boxes] for start in some]) - low)
        / (high - low)
        for some in (found, plain)
    )
    assert np.all((moved >= 0) & (moved <= 1))
    assert np.all((moved - 0.5) * (usual - 0.5) >= 0)  # towards the nearer end
    near = np.minimum(moved, 1 - moved) < 0.1
    assert near.mean() == pytest.approx(0.48, abs=0.03)
    assert np.mean(np.minimum(usual, 1 - usual) < 0.1) == pytest.approx(0.2, abs=0.03)
    assert all(a.parameters == b.parameters for a, b in zip(*starts("exact", extreme=1.0), strict=True))
