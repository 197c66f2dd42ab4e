"""Saving and restoring an environment with all its episodes: it goes on to the bit as it would have.

saved = save_state(env)     # any time after reset; env may be wrapped
restore_state(env, saved)   # as often as wanted, also into another environment of the same arguments
"""

import io
import json
import zipfile
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from epv_env.env import _ValveEnv
from epv_env.plant.parameters import Parameters
from epv_env.plant.supply import Supply
from epv_env.vector_env import _ValveVectorEnv

ValveEnv = _ValveEnv | _ValveVectorEnv
FLAGS = {"_begun", "_done"}
"""Of the vector environment's sub-environments, (n,)."""
PER_EPISODE = ("supplies", "moving_targets", "recorded_consumptions")
"""Objects of each episode that are not numbers: lists of the task."""


class StateError(ValueError):
    """A state cannot be saved or restored: the message says why and what to do."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SavedState:
    """A copy of all that the future of an environment depends on."""

    arrays: dict[str, NDArray]
    """Numbers of all episodes."""
    generators: list[dict[str, Any] | None]
    """States of the generators: of each episode's noise, then of each environment's episodes."""
    objects: dict[str, list[Any]]
    """By PER_EPISODE; shared with the environment, which never changes them."""
    elapsed: int | None
    """Steps that Gymnasium's time limit has counted; None: there is none."""

    def to_bytes(self) -> bytes:
        """The state for a file. Raises StateError where an episode has recordings or signals of its own.

        The file holds numbers only: recordings and signals are the constructor's.
        """
        numbers = dict(self.arrays)
        for name, found in self.objects.items():
            if all(each is found[0] for each in found):
                continue
            if name != "supplies" or any(supply.recording is not None for supply in found):
                raise StateError(f"episodes have {name} of their own: only numbers go into a file")
            numbers[name] = np.array([supply.numbers for supply in found])
        stream = io.BytesIO()
        rest = json.dumps({"generators": self.generators, "elapsed": self.elapsed}, default=_plain)
        np.savez_compressed(stream, rest=np.array(rest), **numbers)  # type: ignore[arg-type]
        return stream.getvalue()

    @classmethod
    def from_bytes(cls, content: bytes, env: gymnasium.Env | gymnasium.vector.VectorEnv) -> "SavedState":
        """The state in a file, for an environment of the same arguments. Raises StateError."""
        task = _unwrapped(env).task
        try:
            with np.load(io.BytesIO(content), allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
            rest = json.loads(str(arrays.pop("rest")))
            generators, elapsed = rest["generators"], rest["elapsed"]
        except (ValueError, KeyError, OSError, EOFError, zipfile.BadZipFile) as error:
            raise StateError(f"this is no saved state ({error}): save it anew") from None
        settings = task.settings
        objects: dict[str, list[Any]] = dict.fromkeys(PER_EPISODE, [None] * task.n)
        own = arrays.pop("supplies", None)
        if own is None:
            objects["supplies"] = [settings.supply] * task.n
        else:
            objects["supplies"] = [Supply.from_numbers(row) for row in own.tolist()]
        return cls(arrays=arrays, generators=generators, objects=objects, elapsed=elapsed)


def save_state(env: gymnasium.Env | gymnasium.vector.VectorEnv) -> SavedState:
    """A copy of the environment's state. Raises StateError before the first reset."""
    valves = _unwrapped(env)
    task = valves.task
    if None in task.parameters:
        raise StateError("not all episodes have begun: call reset() first")
    arrays = {name: array.copy() for name, array in _arrays(valves).items()}
    generators = [*task.noise_of, *_generators(valves)]
    limit = _time_limit(env)
    return SavedState(
        arrays=arrays,
        generators=[None if rng is None else rng.bit_generator.state for rng in generators],
        objects={name: list(getattr(task, name)) for name in PER_EPISODE},
        elapsed=None if limit is None else limit._elapsed_steps,
    )


def restore_state(env: gymnasium.Env | gymnasium.vector.VectorEnv, saved: SavedState) -> None:
    """Put an environment into a saved state.

    Raises StateError, before anything is changed, if it has another number of valves.
    """
    valves = _unwrapped(env)
    task, own = valves.task, _arrays(valves)
    shapes = {name: (array.shape, array.dtype) for name, array in own.items()}
    if shapes != {name: (array.shape, array.dtype) for name, array in saved.arrays.items()}:
        raise StateError("the state is of another environment: restore it where it was saved")
    for name, array in task.memory.items():
        array[...] = saved.arrays[name]
    for name in FLAGS & own.keys():
        setattr(valves, name, saved.arrays[name].copy())
    symbols = list(Parameters.calibrated())
    task.parameters[:] = [
        Parameters.calibrated().replace(**dict(zip(symbols, row, strict=True)))
        for row in task.parameter_values.tolist()
    ]
    for name in PER_EPISODE:
        getattr(task, name)[:] = saved.objects[name]
    task.noise_of[:] = [_generator(state) for state in saved.generators[: task.n]]
    for rng, state in zip(_generators(valves), saved.generators[task.n :], strict=True):
        if state is not None:
            rng.bit_generator.state = state
    task.settle()
    _settle(env, valves, saved.elapsed)


def _unwrapped(env: gymnasium.Env | gymnasium.vector.VectorEnv) -> ValveEnv:
    inner: Any = env.unwrapped
    if not isinstance(inner, ValveEnv):
        raise StateError(f"{inner!r} is no environment of valves: give one that epv_env registers")
    return inner


def _arrays(valves: ValveEnv) -> dict[str, NDArray]:
    """All arrays that hold the state, by name; the environment's own, not copies."""
    flags = {name: getattr(valves, name) for name in FLAGS if hasattr(valves, name)}
    return {**valves.task.memory, **flags}


def _generators(valves: ValveEnv) -> list[np.random.Generator]:
    """From which the environment draws its next episodes."""
    return valves._rngs if isinstance(valves, _ValveVectorEnv) else [valves.np_random]


def _generator(state: dict[str, Any] | None) -> np.random.Generator | None:
    if state is None:
        return None
    rng = np.random.default_rng(0)
    rng.bit_generator.state = state
    return rng


def _time_limit(env: Any) -> gymnasium.wrappers.TimeLimit | None:
    """The wrapper that counts a single environment's steps."""
    while isinstance(env, gymnasium.Wrapper):
        if isinstance(env, gymnasium.wrappers.TimeLimit):
            return env
        env = env.env
    return None


def _settle(env: Any, valves: ValveEnv, elapsed: int | None) -> None:
    """Set what the arrays do not hold."""
    if isinstance(valves, _ValveVectorEnv):
        valves._all_begun = bool(valves._begun.all())
        valves._some_done = bool(valves._done.any())
    limit = _time_limit(env)
    if limit is not None:
        limit._elapsed_steps = elapsed


def _plain(value: Any) -> Any:
    """Numbers and arrays of a generator's state as JSON takes them."""
    return value.tolist()
