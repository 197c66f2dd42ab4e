"""Running vector environments through prescribed actions, and comparing what comes out to the bit."""

from collections.abc import Callable
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from numpy.typing import NDArray

import epv_env  # noqa: F401 - registers the ids

IDS = ("EPValve-v0", "EPValvePWM-v0")

ENDING = {
    "supply": 2.0,
    "target_bar": 2.0,
    "p2_bar": (1.51, 1.8),
    "scenario": "leak",
    "parameters": {"V2": (1e-4, 3e-4)},
}
"""Options under which some circuits run empty within a few periods: 2 bar do not open the valve."""


class Step(NamedTuple):
    """What step() returned; arrays (n, ...)."""

    observation: NDArray
    reward: NDArray
    terminated: NDArray
    truncated: NDArray
    infos: dict[str, Any]


class Rollout(NamedTuple):
    """A reset and the steps after it."""

    first: NDArray
    steps: list[Step]


def native(identifier: str, n: int, **options: Any) -> Any:
    """The compiled batch."""
    return gymnasium.make_vec(identifier, num_envs=n, vectorization_mode="vector_entry_point", **options)


def side_by_side(
    identifier: str, n: int, mode: AutoresetMode = AutoresetMode.NEXT_STEP, **options: Any
) -> SyncVectorEnv:
    """n single environments under Gymnasium's own SyncVectorEnv."""
    make = [lambda: gymnasium.make(identifier, **options)] * n
    return SyncVectorEnv(make, autoreset_mode=mode)


def actions(identifier: str, n: int, periods: int, seed: int = 0) -> NDArray:
    """Random actions (periods, n, ...); those of environment i do not depend on n."""
    draws = np.stack([np.random.default_rng((seed, i)).random(periods) for i in range(n)], axis=1)
    if identifier == "EPValve-v0":
        return (draws > 0.5).astype(np.int64)
    return np.clip(4 * draws - 2, -1, 1).astype(np.float32)[..., None]


def run(
    env: Any,
    commands: NDArray,
    seed: Any = 0,
    options: dict[str, Any] | None = None,
    after_step: Callable[[Any, Step], None] = lambda env, step: None,
) -> Rollout:
    """Reset, then step through commands (periods, n, ...)."""
    first, _ = env.reset(seed=seed, options=options)
    rollout = Rollout(first.copy(), [])
    for command in commands:
        observation, *rest = env.step(command)
        reward, terminated, truncated = (np.array(value) for value in rest[:3])
        step = Step(observation.copy(), reward, terminated, truncated, rest[3])
        rollout.steps.append(step)
        after_step(env, step)
    env.close()
    return rollout


def reset_ended(env: Any, step: Step) -> None:
    """Reset what has ended, as autoreset mode DISABLED leaves to the caller."""
    ended = step.terminated | step.truncated
    if ended.any():
        step.observation[:] = env.reset(options={"reset_mask": ended})[0]


def assert_same_infos(found: dict[str, Any], expected: dict[str, Any], n: int) -> None:
    """Masks are equal, and so are the values that they mark as valid."""
    keys = {key for key in {**found, **expected} if not key.startswith("_")}
    for key in keys:
        nothing = np.zeros(n, dtype=bool)
        valid = found.get(f"_{key}", nothing)
        np.testing.assert_array_equal(valid, expected.get(f"_{key}", nothing), err_msg=key)
        if not valid.any():
            continue
        if isinstance(found[key], dict):
            assert_same_infos(found[key], expected[key], n)
        elif found[key].dtype == object:
            for i in np.flatnonzero(valid):
                np.testing.assert_array_equal(found[key][i], expected[key][i], err_msg=key)
        else:
            assert found[key].dtype == expected[key].dtype, key
            np.testing.assert_array_equal(found[key][valid], expected[key][valid], err_msg=key)


def assert_same(found: Rollout, expected: Rollout) -> None:
    """Two rollouts agree to the bit."""
    np.testing.assert_array_equal(found.first, expected.first)
    assert len(found.steps) == len(expected.steps)
    for k, (a, b) in enumerate(zip(found.steps, expected.steps, strict=True)):
        for name in ("observation", "reward", "terminated", "truncated"):
            np.testing.assert_array_equal(
                getattr(a, name), getattr(b, name), err_msg=f"{name} in step {k}"
            )
        assert_same_infos(a.infos, b.infos, len(a.reward))


def part(rollout: Rollout, which: slice) -> Rollout:
    """Some sub-environments of a rollout in which no episode ends."""
    steps = [
        Step(
            step.observation[which],
            step.reward[which],
            step.terminated[which],
            step.truncated[which],
            {key: value[which] for key, value in step.infos.items()},
        )
        for step in rollout.steps
    ]
    return Rollout(rollout.first[which], steps)
