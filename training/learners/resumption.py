"""What a training needs beside its networks to go on to the bit: episodes, generators, averages."""

import io
import zipfile
from collections import deque
from collections.abc import Iterator
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnvWrapper, VecMonitor

from epv_env.saved_state import SavedState, restore_state, save_state
from epv_env.sb3 import SB3VectorEnv
from training.learners.governed_wrapper import GovernedWrapper
from training.learners.privileged_wrapper import PrivilegedWrapper
from training.learners.recurrent_state_wrapper import RecurrentStateWrapper
from training.learners.run_state import RunError
from training.learners.sequence_ppo import SequencePPO

MONITORED = ("r", "l", "t")
"""Return, length and time of an episode, as VecMonitor calls them."""


def save_progress(model: PPO) -> bytes:
    """The state of a model's environments and of all generators, between two rollouts."""
    name, keys, place, has_gauss, gauss = np.random.get_state()  # noqa: NPY002 - the library draws here
    episodes = list(model.ep_info_buffer or [])
    arrays: dict[str, NDArray] = {
        "env": np.frombuffer(save_state(_inner(model).env).to_bytes(), dtype=np.uint8),
        "torch": torch.get_rng_state().numpy(),
        "numpy_keys": np.asarray(keys),
        "numpy_rest": np.array([place, has_gauss, gauss], dtype=float),
        "last_obs": np.asarray(model._last_obs),
        "last_starts": np.asarray(model._last_episode_starts),
        "episodes": np.array([[float(e[key]) for key in MONITORED] for e in episodes]).reshape(-1, 3),
        "successes": np.array(list(model.ep_success_buffer or []), dtype=bool),
        "updates": np.array(model._n_updates),
    }
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays, **_of_wrappers(model))  # type: ignore[arg-type]
    assert name == "MT19937"
    return stream.getvalue()


def restore_progress(model: PPO, content: bytes) -> None:
    """Put a model's environments and all generators into a saved state.

    model: with the number of environments with which it was saved. Raises RunError for damaged content.
    """
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            saved = {name: file[name] for name in file.files}
        env = _inner(model).env
        restore_state(env, SavedState.from_bytes(saved["env"].tobytes(), env))
        own = _of_wrappers(model, fresh=True)
        if any(saved[name].shape != array.shape for name, array in own.items()):
            raise ValueError("it is of other environments")
        place, has_gauss, gauss = saved["numpy_rest"].tolist()
        state = ("MT19937", saved["numpy_keys"], int(place), int(has_gauss), gauss)
        np.random.set_state(state)  # noqa: NPY002
        torch.set_rng_state(torch.from_numpy(saved["torch"]))
    except (ValueError, KeyError, OSError, RuntimeError, zipfile.BadZipFile) as error:
        raise RunError(f"the checkpoint's episodes cannot be restored ({error}): begin anew") from None
    for name, wrapper, attribute in _wrapped(model):
        setattr(wrapper, attribute, saved[name])
    for wrapper in _layers(model):
        if isinstance(wrapper, PrivilegedWrapper):
            wrapper.foresee(np.arange(wrapper.num_envs))
    model._last_obs = saved["last_obs"]
    model._last_episode_starts = saved["last_starts"]
    model._n_updates = int(saved["updates"])
    episodes = [dict(zip(MONITORED, row, strict=True)) for row in saved["episodes"].tolist()]
    window = model._stats_window_size
    model.ep_info_buffer = deque(episodes, maxlen=window)
    model.ep_success_buffer = deque(saved["successes"].tolist(), maxlen=window)


def _layers(model: PPO) -> Iterator[Any]:
    """The environment with its wrappers, the outermost first."""
    env: Any = model.get_env()
    while isinstance(env, VecEnvWrapper):
        yield env
        env = env.venv
    yield env


def _inner(model: PPO) -> SB3VectorEnv:
    env = model.get_env()
    assert env is not None
    assert isinstance(env.unwrapped, SB3VectorEnv)
    return env.unwrapped


def _wrapped(model: PPO) -> Iterator[tuple[str, Any, str]]:
    """Name in the file, owner and attribute of each array that wrappers and the model keep."""
    for wrapper in _layers(model):
        if isinstance(wrapper, VecMonitor):
            yield "returns", wrapper, "episode_returns"
            yield "lengths", wrapper, "episode_lengths"
        if isinstance(wrapper, RecurrentStateWrapper):
            yield "memory", wrapper, "state"
        if isinstance(wrapper, PrivilegedWrapper):
            yield "left", wrapper, "left"
            yield "reached", wrapper, "reached"
        if isinstance(wrapper, GovernedWrapper):
            yield "shift", wrapper, "shift"
            yield "must_shut", wrapper, "must_shut"
            for name, owner, attribute in wrapper.governor.arrays():
                yield f"governor_{name}", owner, attribute
    if isinstance(model, SequencePPO):
        yield "memory", model, "memory"


def _of_wrappers(model: PPO, *, fresh: bool = False) -> dict[str, NDArray]:
    """The arrays that wrappers keep, by name. fresh: also before the reset that makes them."""
    n = _inner(model).num_envs
    return {
        name: np.zeros(n) if fresh and not hasattr(wrapper, attribute) else getattr(wrapper, attribute)
        for name, wrapper, attribute in _wrapped(model)
    }
