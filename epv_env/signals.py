"""What may stand for a number: a range, a target that moves, a recorded consumption."""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from types import NoneType
from typing import Annotated, Any, NamedTuple, TypeVar, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import ArrayLike, NDArray

from epv_env.common.field_types import check_fields, real, shown
from epv_env.common.units import GRAM
from epv_env.plant.supply import Supply

Signal = TypeVar("Signal")

Range = tuple[float, float]
"""Least and greatest value."""

PRESSURE_LIMITS_BAR = (1.0, 16.0)
"""Range of the pressure sensors (Table 1), bar absolute."""


class OptionError(ValueError):
    """An environment option is unknown or out of range: the message says which and the remedy."""


def check_count(name: str, value: Any, least: int = 1, most: int = 10**9) -> None:
    """Raises OptionError unless the value is a whole number from `least` to `most`."""
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not whole or not least <= value <= most:
        raise OptionError(f"{name} = {shown(value)}: give a whole number from {least} to {most}")


def check_known(what: str, names: Iterable[Any], known: Collection[str]) -> None:
    """Raises OptionError for a name that is not among the known ones. what: the kind of name."""
    for name in names:
        if name not in known:
            raise OptionError(f"unknown {what} {shown(name)}: known are {', '.join(known)}")


def as_seed(value: Any) -> int | None:
    """A seed that Gymnasium takes. Raises OptionError."""
    if value is None:
        return None
    check_count("seed", value, least=0, most=2**64)
    return int(value)


def checked_flag(name: str, value: Any) -> bool:
    """The value, if it is True or False. Raises OptionError."""
    if not isinstance(value, (bool, np.bool_)):
        raise OptionError(f"{name} = {shown(value)}: give True or False")
    return bool(value)


def as_number(name: str, value: Any, limits: Range) -> float:
    """A number inside the limits. Raises OptionError."""
    low, high = limits
    try:
        number = real(value)
    except TypeError:
        raise OptionError(f"{name} is {shown(value)}: give a number from {low:g} to {high:g}") from None
    if not low <= number <= high:
        raise OptionError(f"{name} = {number:g} must lie in {low:g} to {high:g}")
    return number


def as_range(name: str, value: Any, limits: Range = PRESSURE_LIMITS_BAR) -> Range:
    """A number or (low, high) as a range inside the limits. Raises OptionError."""
    try:
        low, high = (real(end) for end in (value if np.ndim(value) else (value, value)))
    except (TypeError, ValueError):
        raise OptionError(f"{name} is {shown(value)}: give a number or (low, high)") from None
    if not limits[0] <= low <= high <= limits[1]:
        raise OptionError(
            f"{name} = [{low:g}, {high:g}] must satisfy {limits[0]:g} <= low <= high <= {limits[1]:g}"
        )
    return low, high


def check_limits(settings: Any, where: str = "") -> None:
    """Check the fields of a dataclass's instance that are annotated with limits, None where it may be.

    A number that stands for a range becomes one. where: begins the name in messages. Raises OptionError.
    """
    for name, (kind, limits) in _limits(type(settings)).items():
        value, read = getattr(settings, name), as_number if kind is float else as_range
        if value is not None or NoneType not in get_args(kind):
            object.__setattr__(settings, name, read(where + name, value, limits))


@cache
def _limits(dataclass: type) -> dict[str, Any]:
    """Type and limits of each field Annotated[type, limits]."""
    hints = get_type_hints(dataclass, include_extras=True)
    return {name: get_args(h) for name, h in hints.items() if get_origin(h) is Annotated}


class SignalError(ValueError):
    """A signal cannot be used: the message says which, the rule and the remedy."""


@dataclass(frozen=True, eq=False)
class _Interpolated:
    """Linear between samples (samples,), which its text holds; that of a function has an address."""

    time: NDArray
    samples: NDArray

    def __call__(self, seconds: float) -> float:
        return float(np.interp(seconds, self.time, self.samples))


@dataclass(frozen=True, kw_only=True)
class MovingTarget:
    """A target pressure that changes within the episode."""

    at: Callable[[float], float]
    """Target [bar absolute] at a time since the episode's start [s]."""

    def __post_init__(self) -> None:
        check_fields(self, SignalError)

    @classmethod
    def recorded(cls, time_s: ArrayLike, target_bar: ArrayLike) -> "MovingTarget":
        """Linear between samples, and constant beyond their ends.

        time_s: increasing (samples,) [s]. target_bar: (samples,) [bar absolute]. Raises SignalError.
        """
        time, values = _samples("a recorded target", time_s, target_bar)
        return cls(at=_Interpolated(time, values))

    def values(self, time: NDArray, limits: tuple[float, float]) -> NDArray:
        """Targets (n,) [bar absolute] at times (n,) [s].

        Raises SignalError for one outside the limits [bar absolute], or that is no number.
        """
        try:
            targets = np.array([real(self.at(seconds)) for seconds in time.tolist()])
        except TypeError as error:
            raise SignalError(
                f"the target at {time[0]:g} s is no number ({error}): give a function of the time [s] "
                "that returns bar absolute"
            ) from error
        wrong = ~((targets >= limits[0]) & (targets <= limits[1]))  # true for NaN, too
        if np.any(wrong):
            k = int(np.argmax(wrong))
            raise SignalError(
                f"the target is {targets[k]:g} bar at {time[k]:g} s: keep it between {limits[0]:g} and "
                f"{limits[1]:g} bar absolute"
            )
        return targets


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedConsumption:
    """Measured air consumption: linear between samples, constant beyond their ends."""

    time: NDArray
    """Increasing times since the episode's start (samples,) [s]."""
    flow: NDArray
    """Consumption (samples,) [kg/s], at least 0."""

    @classmethod
    def from_samples(cls, time_s: ArrayLike, flow_g_per_s: ArrayLike) -> "RecordedConsumption":
        """time_s: increasing (samples,) [s]. flow_g_per_s: (samples,) [g/s]. Raises SignalError."""
        time, flow = _samples("a recorded consumption", time_s, flow_g_per_s)
        return cls(time=time, flow=flow * GRAM)

    def __post_init__(self) -> None:
        time, flow = _samples("a recorded consumption", self.time, self.flow)
        if np.any(flow < 0):
            k = int(np.argmax(flow < 0))
            raise SignalError(
                f"a recorded consumption is {flow[k] / GRAM:g} g/s at {time[k]:g} s: give flows of at "
                "least 0, since consumers draw air"
            )
        taken = np.concatenate([[0.0], np.cumsum(np.diff(time) * (flow[1:] + flow[:-1]) / 2)])
        vars(self).update(time=time, flow=flow, _taken=taken)  # [kg] until each sample

    def mean_flow(self, time: NDArray, period: float) -> NDArray:
        """Mean flow (n,) [kg/s] over the period [s] that starts at each time (n,) [s]."""
        return (self._until(time + period) - self._until(time)) / period

    def _until(self, time: NDArray) -> NDArray:
        """Air drawn from the first sample until `time` (n,) [kg]; negative before it."""
        k = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, len(self.time) - 1)
        since, begins = time - self.time[k], self.flow[k]
        ends = np.interp(time, self.time, self.flow)
        return self.__dict__["_taken"][k] + since * (begins + ends) / 2


Followed = tuple[Supply | None, MovingTarget | None, RecordedConsumption | None]
"""What an episode follows: a recorded supply, a target, a consumption."""


class Signals(NamedTuple):
    """Signals that are read in every control period, each with the indices of its episodes."""

    supplies: list[tuple[Supply, NDArray]]
    targets: list[tuple[MovingTarget, NDArray]]
    consumptions: list[tuple[RecordedConsumption, NDArray]]


def shared(signals: Sequence[Signal | None]) -> list[tuple[Signal, NDArray]]:
    """Each signal once, with the indices of the episodes that have it, (m,)."""
    once = {id(signal): signal for signal in signals if signal is not None}
    return [(signal, np.flatnonzero([s is signal for s in signals])) for signal in once.values()]


def _samples(what: str, time: ArrayLike, values: ArrayLike) -> tuple[NDArray, NDArray]:
    """Times and values, each (samples,), as arrays. Raises SignalError."""
    try:
        t, v = np.array(time, dtype=float), np.array(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise SignalError(f"{what} needs numbers: give two lists of them") from None
    if t.ndim != 1 or t.shape != v.shape or not 0 < t.size <= 10_000_000:  # more is a slip
        raise SignalError(f"{what} has shapes {t.shape} and {v.shape}: give a value for each time")
    if not (np.all(np.isfinite(t)) and np.all(np.isfinite(v)) and np.all(np.diff(t) > 0)):
        raise SignalError(f"{what} needs increasing times and finite values: leave other samples out")
    return t, v
