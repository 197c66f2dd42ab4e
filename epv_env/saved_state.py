"""Saving and restoring an environment with all its episodes: it goes on to the bit as it would have.

saved = save_state(env)     # any time after reset; env may be wrapped
restore_state(env, saved)   # as often as wanted, also into another environment of the same arguments

`copy.deepcopy` and `pickle` take an environment, too. A pickle may run code; the bytes of a SavedState
hold numbers only. Of wrappers, a time limit takes over the episode's steps; others keep what they hold.
"""

import json
from typing import Any, Literal

import gymnasium
import msgspec
import numpy as np
from numpy.typing import NDArray

from epv_env.common.field_types import shown
from epv_env.env import _ValveEnv
from epv_env.period import rules_of
from epv_env.plant.consumption import APPLICATIONS
from epv_env.plant.supply import Supply
from epv_env.signals import MovingTarget, RecordedConsumption
from epv_env.vector_env import _ValveVectorEnv

ValveEnv = _ValveEnv | _ValveVectorEnv
MEMORY = (
    "episodes",
    "progress",
    "noise",
    "parameter_values",
    "volumes",
    "state",
    "acting_U",
    "delay_left",
)
"""Of `LimitingTask.memory`; the rest follows from the parameters or is set in every period."""
FOLLOWED = (Supply | None, MovingTarget | None, RecordedConsumption | None)
"""Of `LimitingTask.signals`."""
INFINITE = ("idle_until", "p3_frozen_at", "target_steps_at", "volumes")
"""Numbers that may be infinite: never, and a supply that does not sag."""


class StateError(ValueError):
    """A state cannot be saved or restored: the message says why and what to do."""


class SavedState(msgspec.Struct, frozen=True, kw_only=True, eq=False):
    """A copy of all that the future of an environment depends on."""

    version: Literal[1]
    """Of this record and its arrays."""
    origin: dict[str, Any]
    """Class, size and rules of the environment."""
    arrays: dict[str, bytes]
    """Content of the arrays of all episodes."""
    generators: list[str]
    """States of the generators as JSON: of each episode's noise, then of each environment's episodes."""
    signals: list[Any]
    """Of each episode; shared with the environment, which never changes them."""

    def to_bytes(self) -> bytes:
        """The state for a file. Raises StateError where an episode follows a signal."""
        try:
            return msgspec.msgpack.encode(self)
        except TypeError:
            raise StateError(
                "an episode follows a recording or a moving target, but only numbers go into a file: "
                "keep the SavedState itself"
            ) from None

    @classmethod
    def from_bytes(cls, content: bytes) -> "SavedState":
        """The state in a file that `to_bytes` gave. Raises StateError."""
        try:
            return msgspec.msgpack.decode(content, type=cls)
        except (msgspec.MsgspecError, ValueError, RecursionError) as error:
            raise StateError(f"this is no saved state ({error}): save it anew") from None


def save_state(env: gymnasium.Env | gymnasium.vector.VectorEnv) -> SavedState:
    """A copy of the environment's state. Raises StateError before the first reset."""
    valves = _unwrapped(env)
    if None in valves.task.parameters:
        raise StateError("not all episodes have begun: call reset() first")
    generators = [rng for rng in (*valves.task.noise_of, *_generators(valves)) if rng is not None]
    return SavedState(
        version=1,
        origin=_origin(valves),
        arrays={name: array.tobytes() for name, array in _arrays(valves).items()},
        generators=[json.dumps(rng.bit_generator.state, default=str) for rng in generators],
        signals=list(valves.task.signals),
    )


def restore_state(env: gymnasium.Env | gymnasium.vector.VectorEnv, saved: SavedState) -> None:
    """Put an environment into a saved state.

    Raises StateError, before anything is changed, unless it is of an environment of the same arguments
    and every number can be.
    """
    valves = _unwrapped(env)
    task, rngs, centre = valves.task, _generators(valves), valves.settings.region.centre
    if not isinstance(saved, SavedState):
        raise StateError(f"{shown(saved)} is no SavedState: give what save_state returned")
    for name, value in _origin(valves).items():
        if saved.origin.get(name) != value:
            raise StateError(
                f"the state is of an environment with another {name}: make this one with the same "
                "arguments"
            )
    try:
        arrays = {
            name: np.frombuffer(saved.arrays[name], array.dtype).reshape(array.shape)
            for name, array in _arrays(valves).items()
        }
        _check_numbers(arrays)
        rows = arrays["parameter_values"]
        parameters = [centre.replace(**dict(zip(centre, row, strict=True))) for row in rows.tolist()]
        generators = [np.random.default_rng(0) for _ in saved.generators]
        for rng, state in zip(generators, saved.generators, strict=True):
            rng.bit_generator.state = json.loads(state)
        signals: list[Any] = [tuple(followed) for followed in saved.signals]
        if (len(signals), len(generators)) != (task.n, task.n + len(rngs)) or not all(
            len(followed) == 3 and all(map(isinstance, followed, FOLLOWED)) for followed in signals
        ):
            raise ValueError("generators or signals of other episodes")
    except Exception as error:  # of many kinds: the above, NumPy's and JSON's
        raise StateError(f"the state is damaged ({error}): save it anew") from None
    task.parameters[:] = parameters
    p = dict(zip(centre, rows.T, strict=True))
    task.valves.set_parameters(np.arange(task.n), p, arrays["volumes"])
    for name in MEMORY:
        task.memory[name][...] = arrays[name]
    task.signals[:] = signals
    task.noise_of[:] = generators[: task.n]
    for rng, restored in zip(rngs, generators[task.n :], strict=True):
        rng.bit_generator.state = restored.bit_generator.state
    task.settle()
    if isinstance(valves, _ValveVectorEnv):
        valves._done = arrays["_done"].copy()
        valves._some_done = bool(valves._done.any())
    while isinstance(env, gymnasium.Wrapper):
        if isinstance(env, gymnasium.wrappers.TimeLimit):
            env._elapsed_steps = int(task.steps[0])
        env = env.env


def _check_numbers(arrays: dict[str, NDArray]) -> None:
    """Raises ValueError for a number that is not finite, and for an index outside its array."""
    for name, array in arrays.items():
        for field in array.dtype.names or (name,):
            values = array[field] if array.dtype.names else array
            unset = np.isinf(values) & (field in INFINITE) | np.isnan(values) & (field == "acting_U")
            if not np.all(np.isfinite(values) | unset):
                raise ValueError(f"{field} is not finite")
    now = arrays["progress"]["now"]
    if not np.all((now >= 0) & (now < APPLICATIONS)):
        raise ValueError(f"now must be 0 to {APPLICATIONS - 1}")


def _unwrapped(env: gymnasium.Env | gymnasium.vector.VectorEnv) -> ValveEnv:
    inner: Any = getattr(env, "unwrapped", env)
    if not isinstance(inner, ValveEnv):
        raise StateError(f"{shown(inner)} is no environment of valves: give one that epv_env registers")
    return inner


def _origin(valves: ValveEnv) -> dict[str, Any]:
    """What two environments must have in common to exchange their states."""
    rules = rules_of(valves.settings)
    of_task = {name: float(rules[name][0]) for name in rules.dtype.names or ()}
    return {"class": type(valves).__name__, "size": valves.task.n, **of_task}


def _arrays(valves: ValveEnv) -> dict[str, NDArray]:
    """All arrays that hold the state, by name; the environment's own."""
    arrays = {name: valves.task.memory[name] for name in MEMORY}
    return arrays | ({"_done": valves._done} if isinstance(valves, _ValveVectorEnv) else {})


def _generators(valves: ValveEnv) -> list[np.random.Generator]:
    """From which the environment draws its next episodes."""
    return valves._rngs if isinstance(valves, _ValveVectorEnv) else [valves.np_random]
