"""A restored environment goes on to the bit as it would have: single and vector, noise and draws."""

import copy
import pickle
from typing import Any

import gymnasium
import msgspec
import numpy as np
import pytest
from msgspec.structs import replace

import epv_env  # noqa: F401 - registers the ids
from epv_env.plant.lanes import N_STATE
from epv_env.saved_state import SavedState, StateError, restore_state, save_state

KINDS = {
    "nominal": {"parameters": "ten_percent"},
    "with a delay": {
        "effects": {"command_delay": {"t_delay": (0.0, 0.01), "w_delay": 0.5}, "circuit_leak": 1e-7}
    },
    "with signals": {"target_bar": lambda t: 8.0 + 0.1 * t, "supply": 12.0},
}


def make(kind, count, mode="NextStep"):
    if count is None:
        return gymnasium.make("EPValve-v0", max_episode_steps=300, **KINDS[kind])
    return gymnasium.make_vec(
        "EPValve-v0", num_envs=count, max_episode_steps=300, autoreset_mode=mode, **KINDS[kind]
    )


def driven(env, actions):
    """What the environment shows under these actions; a single one begins anew where it ended."""
    shown = []
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(action)
        shown.append((observation, reward, terminated, truncated, info["deviation_bar"]))
        if np.ndim(terminated) == 0 and (terminated or truncated):
            shown.append((env.reset()[0],))
    return pickle.dumps([[np.asarray(value).tobytes() for value in each] for each in shown])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("count", "mode"), [(None, ""), (3, "NextStep"), (3, "SameStep")])
def test_what_follows_is_the_same_to_the_bit(kind, count, mode):
    env, rng = make(kind, count, mode), np.random.default_rng(0)
    env.reset(seed=4)
    actions = rng.integers(0, 2, size=(330, count) if count else 330)
    driven(env, actions[:270])  # beyond a block of noise, and an episode ends soon
    saved, copies = copy.deepcopy(save_state(env)), [copy.deepcopy(env)]
    if kind != "with signals":  # only numbers go into a file
        saved = SavedState.from_bytes(saved.to_bytes())
        copies.append(pickle.loads(pickle.dumps(env)))
    expected = driven(env, actions[270:])
    assert driven(env, actions[270:]) != expected  # the comparison can fail
    another = make(kind, count, mode)
    another.reset(seed=9)
    for each in (env, another):
        restore_state(each, saved)
    for each in (env, another, *copies):
        assert driven(each, actions[270:]) == expected


def test_supplies_of_their_own_survive_a_file():
    """Under conditions some episodes have other reservoirs than the constructor's."""
    options = {"conditions": {"starved": 0.5}, "max_episode_steps": 300, "autoreset_mode": "SameStep"}
    env, other = (gymnasium.make_vec("EPValve-v0", num_envs=6, **options) for _ in range(2))
    for each, seed in ((env, 2), (other, 9)):
        each.reset(seed=seed)
    tasks = [each.unwrapped.task for each in (env, other)]  # type: ignore[attr-defined]
    first = tasks[0].memory["episodes"]["idle_until"].copy()
    assert len(set(first)) > 1
    actions = np.random.default_rng(1).integers(0, 2, size=(400, 6))
    content = save_state(env).to_bytes()
    expected = driven(env, actions)
    restore_state(other, SavedState.from_bytes(content))
    np.testing.assert_array_equal(tasks[1].memory["episodes"]["idle_until"], first)
    assert driven(other, actions) == expected


def test_what_cannot_be_restored_is_refused():
    env = make("nominal", 3)
    with pytest.raises(StateError, match="call reset"):
        save_state(env)
    env.reset(seed=0)
    saved = save_state(env)
    wrong: list[tuple[Any, Any]] = [(env, b"bytes"), (None, saved)]
    for target, state in wrong:
        with pytest.raises(StateError, match="is no"):
            restore_state(target, state)
    other = make("nominal", 2)
    slower = gymnasium.make_vec("EPValve-v0", num_envs=3, control_period=0.01)
    for each, words in ((other, "another size"), (slower, "another control_period")):
        each.reset(seed=0)
        with pytest.raises(StateError, match=words):
            restore_state(each, saved)
    content = saved.to_bytes()
    later = msgspec.msgpack.encode({**msgspec.structs.asdict(saved), "version": 2})
    changed_head = b"\xff" * 60 + content[60:]
    for damaged in (b"", b"no archive", content[:100], changed_head, pickle.dumps(saved), later):
        with pytest.raises(StateError, match="no saved state"):
            SavedState.from_bytes(damaged)


def test_signals_do_not_go_into_a_file():
    env = make("with signals", 2)
    env.reset(seed=0)
    with pytest.raises(StateError, match="only numbers go into a file"):
        save_state(env).to_bytes()


def changed(saved, env, array, place, value):
    """The state with another number in the second episode of an array of this environment's."""
    own = env.unwrapped.task.memory[array]
    numbers = np.frombuffer(saved.arrays[array], own.dtype).reshape(own.shape).copy()
    numbers[place][1] = value
    return replace(saved, arrays={**saved.arrays, array: numbers.tobytes()})


WRONG = {
    "progress": [("now", 10**6), ("now", -1), ("leak", np.nan), ("offset", np.inf)],
    "episodes": [("p1_slope", np.inf), ("target", np.nan), ("waited", np.inf)],
    "noise": [(0, np.nan)],
    "state": [(0, np.inf), (0, np.nan)],
    "parameter_values": [(0, np.nan), (0, -1.0)],
    "delay_left": [(slice(None), np.inf)],
}


@pytest.mark.parametrize(
    ("array", "place", "value"), [(a, *w) for a, all_ in WRONG.items() for w in all_]
)
def test_a_number_that_cannot_be_is_refused_and_nothing_changes(array, place, value):
    env = make("nominal", 2)
    env.reset(seed=3)
    with pytest.raises(StateError, match=r"the state is damaged \("):
        restore_state(env, changed(save_state(env), env, array, place, value))
    untouched = make("nominal", 2)
    untouched.reset(seed=3)
    on = np.ones((5, 2), dtype=int)
    assert driven(env, on) == driven(untouched, on)


@pytest.mark.parametrize("row", range(N_STATE))
@pytest.mark.parametrize("value", [-1.0, 1e300])
def test_a_state_beyond_all_valves_shows_no_learner_a_number_that_is_none(row, value):
    env = make("nominal", 2)
    env.reset(seed=3)
    restore_state(env, changed(save_state(env), env, "state", row, value))
    observation, reward, *_ = env.step(np.ones(2, dtype=int))
    assert np.all(np.isfinite(observation))
    assert np.all(np.isfinite(np.asarray(reward)))


@pytest.mark.parametrize(
    ("part", "value"),
    [
        ("generators", ["{}"]),
        ("generators", ["7"] * 2),
        ("generators", []),
        ("signals", []),
        ("signals", [[None, None, "x"]]),
        ("signals", [[]]),
        ("arrays", {}),
    ],
)
def test_parts_that_cannot_be_are_refused(part, value):
    env = make("nominal", None)
    env.reset(seed=3)
    content = replace(save_state(env), **{part: value}).to_bytes()
    with pytest.raises(StateError, match="the state is damaged"):
        restore_state(env, SavedState.from_bytes(content))
