"""Seeds decide everything; settings compared under one seed meet the same disturbance and noise."""

import numpy as np
import pytest

from tests.env.rollouts import IDS, actions, assert_same, native, run

pytestmark = pytest.mark.parametrize("identifier", IDS)
PERIODS = {"EPValve-v0": 320, "EPValvePWM-v0": 80}
"""Long enough to meet a brake application, and too short for an empty circuit: 1.6 s."""


def consumption(identifier, **options):
    """What the consumers of three environments draw under one seed [g/s], (periods, 3)."""
    found = run(
        native(identifier, 3), actions(identifier, 3, PERIODS[identifier]), seed=11, options=options
    )
    return np.array([step.infos["consumption_g_per_s"] for step in found.steps])


def test_one_seed_gives_one_trajectory(identifier):
    commands = actions(identifier, 3, 40)
    assert_same(run(native(identifier, 3), commands), run(native(identifier, 3), commands))


def test_an_environment_used_before_gives_the_same_trajectory(identifier):
    commands = actions(identifier, 3, 40)
    used = native(identifier, 3, max_episode_steps=7)
    used.reset(seed=99)
    for command in commands:
        used.step(command)
    fresh = native(identifier, 3, max_episode_steps=7)
    assert_same(run(used, commands, seed=1), run(fresh, commands, seed=1))


def test_seeds_and_episodes_differ(identifier):
    env = native(identifier, 2)
    starts = [env.reset(seed=0)[0], env.reset()[0], env.reset()[0], env.reset(seed=5)[0]]
    assert len(np.unique(np.concatenate(starts), axis=0)) == 8


@pytest.mark.parametrize("parameters", ["domain", {"alphaMV": 0.6, "V2": (5e-4, 2e-3)}], ids=str)
def test_other_parameters_meet_the_same_consumption(identifier, parameters):
    found = consumption(identifier, parameters=parameters, scenario="steps")
    expected = consumption(identifier, scenario="steps")
    np.testing.assert_array_equal(found, expected)
    assert np.ptp(expected) > 1.0


def test_other_parameters_meet_the_same_noise(identifier):
    """Which valve is behind the sensor of a supply that does not sag cannot be told from it."""
    steady = {"supply": 9.0, "target_bar": 7.0, "scenario": "none"}
    commands = np.ones_like(actions(identifier, 3, 40))
    found, expected = (
        run(native(identifier, 3), commands, options={**steady, "parameters": parameters})
        for parameters in ("exact", {"V2": 5e-4, "alphaPV": 0.25})
    )
    p1 = [np.array([step.observation[:, 2] for step in rollout.steps]) for rollout in (found, expected)]
    np.testing.assert_array_equal(p1[0], p1[1])
    assert np.ptp(p1[0]) > 0


def test_the_controller_s_actions_do_not_change_the_consumption(identifier):
    commands = actions(identifier, 3, PERIODS[identifier])
    for other in (actions(identifier, 3, PERIODS[identifier], seed=1), np.ones_like(commands)):
        found, expected = (
            [step.infos["consumption_g_per_s"] for step in run(native(identifier, 3), given).steps]
            for given in (commands, other)
        )
        np.testing.assert_array_equal(found, expected)
