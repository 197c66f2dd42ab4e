"""The vector environment is n single environments, to the bit, whatever n, threads and autoreset."""

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from epv_env.signals import RecordedConsumption
from tests.env.rollouts import (
    ENDING,
    IDS,
    actions,
    assert_same,
    native,
    part,
    reset_ended,
    run,
    side_by_side,
)
from tests.env.test_options import MIXTURE

PERIODS = 60
LIMIT = 12
"""Control periods of an episode, so that a rollout of PERIODS meets several truncations."""
EVERYTHING = {"parameters": "sensitive_ten_percent", "target_bar": (6.0, 9.0)}

pytestmark = pytest.mark.parametrize("identifier", IDS)


ALIKE = {
    "mixture": {"parameters": MIXTURE, "privileged": True},
    "signals and effects": {
        "target_bar": lambda t: 8.0 + np.sin(t), "supply": 12.0, "p2_bar": 7.0, "privileged": True,
        "scenario": RecordedConsumption.from_samples([0.0, 0.2], [0.0, 4.0]),
        "effects": {"eddy_current": (0.0, 0.004)},
    },
}  # fmt: skip


@pytest.mark.parametrize(
    ("n", "options"),
    [(1, EVERYTHING), (3, EVERYTHING), (17, EVERYTHING), *[(5, options) for options in ALIKE.values()]],
    ids=["1", "3", "17", *ALIKE],
)
def test_trajectories_are_those_of_sync_vector_env(identifier, n, options):
    commands = actions(identifier, n, PERIODS)
    found = run(native(identifier, n, **options), commands, seed=n)
    assert_same(found, run(side_by_side(identifier, n, **options), commands, seed=n))


@pytest.mark.parametrize("seed", [5, [7, 1, 7], [7, 2**40, 0]])
def test_seeds_mean_the_same_as_in_sync_vector_env(identifier, seed):
    commands = actions(identifier, 3, 3)
    found = run(native(identifier, 3), commands, seed=seed)
    assert_same(found, run(side_by_side(identifier, 3), commands, seed=seed))


@pytest.mark.parametrize("mode", list(AutoresetMode), ids=lambda mode: mode.value)
def test_autoreset_is_that_of_sync_vector_env(identifier, mode):
    n, options = 5, {**ENDING, "max_episode_steps": LIMIT}
    commands = actions(identifier, n, PERIODS)
    after = reset_ended if mode is AutoresetMode.DISABLED else lambda env, step: None
    batch = native(identifier, n, autoreset_mode=mode, **options)
    found = run(batch, commands, after_step=after)
    assert_same(found, run(side_by_side(identifier, n, mode, **options), commands, after_step=after))
    assert any(step.terminated.any() for step in found.steps)
    assert any(step.truncated.any() for step in found.steps)
    assert any(step.terminated.any() and not step.terminated.all() for step in found.steps)


def test_a_long_episode_crosses_every_block_of_noise_alike(identifier):
    commands = actions(identifier, 1, 300)
    found = run(native(identifier, 1, max_episode_steps=None), commands)
    assert_same(found, run(side_by_side(identifier, 1, max_episode_steps=1000), commands))


def test_a_trajectory_does_not_depend_on_companions_or_threads(identifier):
    few = run(native(identifier, 3, **EVERYTHING), actions(identifier, 3, PERIODS))
    many = run(native(identifier, 150, threads=2, **EVERYTHING), actions(identifier, 150, PERIODS))
    assert_same(part(many, slice(0, 3)), few)


def test_the_comparison_can_fail(identifier):
    """Another seed, another action or another parameter is noticed."""
    commands = actions(identifier, 3, 20)
    reference = run(native(identifier, 3), commands)
    changed = commands.copy()
    changed[-1] = 1 - changed[-1]
    others = [
        run(native(identifier, 3), commands, seed=1),
        run(native(identifier, 3), changed),
        run(native(identifier, 3), commands, options={"parameters": {"R": 42.2}}),
    ]
    for other in others:
        with pytest.raises(AssertionError):
            assert_same(other, reference)


def test_what_step_returns_belongs_to_the_caller(identifier):
    """Overwriting results changes nothing later."""
    commands = actions(identifier, 2, 3)
    env, untouched = native(identifier, 2), native(identifier, 2)
    env.reset(seed=0)
    untouched.reset(seed=0)
    for command in commands:
        *arrays, infos = env.step(command)
        expected = untouched.step(command)
        np.testing.assert_array_equal(arrays[0], expected[0])
        for array in [*arrays, *infos.values()]:
            array[:] = 0
    np.testing.assert_array_equal(env.reset(seed=0)[0], untouched.reset(seed=0)[0])
