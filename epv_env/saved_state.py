"""Saving and restoring an environment with all its episodes: it goes on to the bit as it would have.

saved = save_state(env)     # any time after reset; env may be wrapped
restore_state(env, saved)   # as often as wanted, also into another environment of the same arguments
"""

import io
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from epv_env.common.field_types import shown
from epv_env.env import _ValveEnv
from epv_env.period import rules_of
from epv_env.plant.consumption import APPLICATIONS
from epv_env.plant.equations import State
from epv_env.plant.parameters import ParameterError, Parameters
from epv_env.plant.supply import Supply
from epv_env.signals import Range
from epv_env.vector_env import _ValveVectorEnv

ValveEnv = _ValveEnv | _ValveVectorEnv
MEMORY = ("episodes", "progress", "noise", "parameter_values", "state", "acting_U", "delay_left")
"""Of `LimitingTask.memory`; the rest follows from the parameters or is set in every period."""
MOST = 1e9
"""More than any finite quantity of an episode has [SI]."""


def _each(names: str, low: float, high: float) -> dict[str, Range]:
    return dict.fromkeys(names.split(), (low, high))


LIMITS: dict[str, Range] = {
    **_each("now", 0, APPLICATIONS - 1),
    **_each("coil compressor violated _done action", 0, 1),
    **_each("steps waited offset", 0, 2.0**53),
    **_each("idle_until p3_frozen_at target_steps_at", 0, np.inf),
    **_each("target target_steps_to", 0, 100),
    **_each("reading p2_history p3_history", -20, 20),
    **_each("cut_in cut_out delivery noise_factor applications span", 0, MOST),
    **_each("leak", -1e-9, MOST),  # a recorded flow of 0 is a difference of sums
    **_each("p1_slope", -1e11, 1e11),
    **_each("p1 p2 p3", 0, 1e7),
    **_each("xPV xMV", -1e-3, 1.001),  # share of the stroke
    **_each("vPV vMV", -50, 50),
    **_each("I I_coil", -10, 10),
    **_each("air_in_PV air_in_MV air_vented coil_energy", -MOST, MOST),
    **_each("coil_heat", -1e3, 1e3),
    **_each("heat_3 heat_2", -1, 10),
    **_each("far_pressure supply_drop lag_2 lag_3", -1e7, 1e7),
    **_each("noise", -MOST, MOST),
    **_each("acting_U", -32, 32),
    **_each("delay_left", 0, 1),
}
"""Least and greatest value of every field and array [SI, bar, A]: what a restored state may hold. The
domains of the parameters are the parameter table's."""
PER_EPISODE = ("supplies", "moving_targets", "recorded_consumptions")
"""Objects of each episode that are not numbers: lists of the task."""


class StateError(ValueError):
    """A state cannot be saved or restored: the message says why and what to do."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SavedState:
    """A copy of all that the future of an environment depends on."""

    kind: str
    """Class of the environment that it is of."""
    arrays: dict[str, NDArray]
    """Numbers of all episodes, and the rules of the task."""
    generators: list[dict[str, Any] | None]
    """States of the generators: of each episode's noise, then of each environment's episodes."""
    objects: dict[str, list[Any]]
    """By PER_EPISODE; shared with the environment, which never changes them."""
    elapsed: int | None
    """Steps that Gymnasium's time limit has counted; None: there is none."""

    def to_bytes(self) -> bytes:
        """The state for a file, which holds numbers only.

        Raises StateError where an episode follows a recording or a moving target.
        """
        signals = [supply.recording for supply in self.objects["supplies"]]
        signals += self.objects["moving_targets"] + self.objects["recorded_consumptions"]
        if any(signal is not None for signal in signals):
            raise StateError(
                "an episode follows a recording or a moving target, but only numbers go into a file: "
                "keep the SavedState itself"
            )
        supplies = np.array([supply.numbers for supply in self.objects["supplies"]])
        others = {"kind": self.kind, "generators": self.generators, "elapsed": self.elapsed}
        rest = np.array(json.dumps(others, default=_plain))
        stream = io.BytesIO()
        np.savez_compressed(stream, rest=rest, supplies=supplies, **self.arrays)  # type: ignore[arg-type]
        return stream.getvalue()

    @classmethod
    def from_bytes(cls, content: bytes) -> "SavedState":
        """The state in a file that `to_bytes` gave. Raises StateError."""
        try:
            with np.load(io.BytesIO(content), allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
            rest = json.loads(str(arrays.pop("rest")))
            supplies = [Supply.from_numbers(row) for row in arrays.pop("supplies").tolist()]
            objects = {**dict.fromkeys(PER_EPISODE, [None] * len(supplies)), "supplies": supplies}
            return cls(arrays=arrays, objects=objects, **rest)
        except Exception as error:  # damaged bytes: of zip, zlib, NumPy or JSON
            raise StateError(f"this is no saved state ({error}): save it anew") from None


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
        kind=type(valves).__name__,
        arrays=arrays,
        generators=[None if rng is None else rng.bit_generator.state for rng in generators],
        objects={name: list(getattr(task, name)) for name in PER_EPISODE},
        elapsed=None if limit is None else limit._elapsed_steps,
    )


def restore_state(env: gymnasium.Env | gymnasium.vector.VectorEnv, saved: SavedState) -> None:
    """Put an environment into a saved state.

    Raises StateError, before anything is changed, unless it is of an environment of the same arguments
    and every number lies within its limits.
    """
    valves = _unwrapped(env)
    task = valves.task
    _check_origin(valves, saved)
    parameters = _parameters(task.settings.region.centre, saved.arrays["parameter_values"])
    _check_numbers(saved.arrays)
    generators = _checked_generators(saved.generators, task.n + len(_generators(valves)))
    limit = _time_limit(env)
    counted = isinstance(saved.elapsed, int) and saved.elapsed >= 0
    if (limit is None) != (saved.elapsed is None) or not (limit is None or counted):
        raise StateError(f"the state has counted {saved.elapsed!r} steps: restore it where it was saved")
    if {len(saved.objects[name]) for name in PER_EPISODE} != {task.n}:
        raise StateError("the state has objects of other episodes: restore it where it was saved")
    task.parameters[:] = parameters
    for name in PER_EPISODE:
        getattr(task, name)[:] = saved.objects[name]
    p = dict(zip(parameters[0], saved.arrays["parameter_values"].T, strict=True))
    task.valves.set_parameters(np.arange(task.n), p, [supply.volume for supply in task.supplies])
    for name in MEMORY:
        task.memory[name][...] = saved.arrays[name]
    task.noise_of[:] = generators[: task.n]
    for rng, found in zip(_generators(valves), generators[task.n :], strict=True):
        if found is not None:
            rng.bit_generator.state = found.bit_generator.state
    task.settle()
    if isinstance(valves, _ValveVectorEnv):
        valves._done = saved.arrays["_done"].copy()
        valves._some_done = bool(valves._done.any())
    if limit is not None:
        limit._elapsed_steps = saved.elapsed


def _check_origin(valves: ValveEnv, saved: SavedState) -> None:
    """Raises StateError unless the state is of an environment of this kind, size and task."""
    own = _arrays(valves)
    if not isinstance(saved, SavedState):
        raise StateError(f"{shown(saved)} is no SavedState: give what save_state returned")
    if saved.kind != type(valves).__name__ or _shapes(own) != _shapes(saved.arrays):
        raise StateError("the state is of another environment: restore it where it was saved")
    rules, found = own["rules"], saved.arrays["rules"]
    if different := [name for name in rules.dtype.names or () if rules[name] != found[name]]:
        raise StateError(
            f"the state is of an environment with another {different[0]}: make this one with the same "
            "arguments"
        )


def _shapes(arrays: Mapping[str, NDArray]) -> dict[str, Any]:
    return {name: (array.shape, array.dtype) for name, array in arrays.items()}


def _check_numbers(arrays: Mapping[str, NDArray]) -> None:
    """Raises StateError for a number outside its limits, NaN included: compiled code indexes by some."""
    for name, values in _fields(arrays):
        low, high = LIMITS[name]
        if not np.all((values >= low) & (values <= high)):
            raise StateError(f"{name} of the state lies outside {low:g} to {high:g}: save it anew")


def _fields(arrays: Mapping[str, NDArray]) -> Iterator[tuple[str, NDArray]]:
    """Names as in LIMITS and values of all that a state holds, but the parameters."""
    for name in ("episodes", "progress"):
        for field in arrays[name].dtype.names or ():
            values = arrays[name][field]
            known = "noise_factor" if field == "noise" else field
            yield known, values.view(np.uint8) if values.dtype == bool else values
    p = dict(zip(Parameters.calibrated(), arrays["parameter_values"].T, strict=True))
    for name, values in zip(State._fields, arrays["state"], strict=True):
        stroke = p.get(f"{name}max")
        yield name, values if stroke is None else values[: len(stroke)] / stroke
    yield "noise", arrays["noise"]
    yield "acting_U", np.where(np.isnan(arrays["acting_U"]), 0.0, arrays["acting_U"])  # NaN: none yet
    yield "delay_left", arrays["delay_left"]
    if "_done" in arrays:
        yield "_done", arrays["_done"].view(np.uint8)


def _parameters(centre: Parameters, values: NDArray) -> list[Parameters]:
    """The parameters of each episode from rows of values. Raises StateError."""
    try:
        return [centre.replace(**dict(zip(centre, row, strict=True))) for row in values.tolist()]
    except ParameterError as error:
        raise StateError(f"the state's {error}") from None


def _checked_generators(states: list[Any], count: int) -> list[np.random.Generator | None]:
    """Generators in these states. Raises StateError."""
    found = [None if state is None else np.random.default_rng(0) for state in states]
    try:
        for rng, state in zip(found, states, strict=True):
            if rng is not None:
                rng.bit_generator.state = state
    except Exception as error:  # NumPy's, of many kinds
        raise StateError(f"a generator of the state is damaged ({error}): save it anew") from None
    if len(found) != count:
        raise StateError(f"the state has {len(found)} generators, not {count}: save it anew")
    return found


def _unwrapped(env: gymnasium.Env | gymnasium.vector.VectorEnv) -> ValveEnv:
    inner: Any = getattr(env, "unwrapped", env)
    if not isinstance(inner, ValveEnv):
        raise StateError(f"{shown(inner)} is no environment of valves: give one that epv_env registers")
    return inner


def _arrays(valves: ValveEnv) -> dict[str, NDArray]:
    """All arrays that hold the state, by name, and the task's rules; the environment's own."""
    task = valves.task
    done = {"_done": valves._done} if isinstance(valves, _ValveVectorEnv) else {}
    return {**{name: task.memory[name] for name in MEMORY}, "rules": rules_of(task.settings), **done}


def _generators(valves: ValveEnv) -> list[np.random.Generator]:
    """From which the environment draws its next episodes."""
    return valves._rngs if isinstance(valves, _ValveVectorEnv) else [valves.np_random]


def _time_limit(env: Any) -> gymnasium.wrappers.TimeLimit | None:
    """The wrapper that counts a single environment's steps."""
    while isinstance(env, gymnasium.Wrapper):
        if isinstance(env, gymnasium.wrappers.TimeLimit):
            return env
        env = env.env
    return None


def _plain(value: Any) -> Any:
    """Numbers and arrays of a generator's state as JSON takes them."""
    return value.tolist()
