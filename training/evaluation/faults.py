"""A fault of the control unit, worn around a controller: the controller knows nothing of it."""

from dataclasses import dataclass, field

from numpy.typing import NDArray

from controllers.base import Controller


@dataclass(frozen=True, kw_only=True)
class Restart:
    """The control unit restarts: the controller forgets everything, and the plant goes on."""

    at: float
    """Time since the episode's start [s]."""

    def around(self, controller: Controller, period: float) -> Controller:
        """The controller with the fault; period: time between its decisions [s]."""
        return _Restarted(inner=controller, first=round(self.at / period))


@dataclass
class _Restarted:
    """Counts the decisions of a controller; `first` is the one that meets the fault."""

    inner: Controller
    first: int
    name: str = field(init=False)
    environment: str = field(init=False)
    _decisions: int = field(init=False, default=0)
    _n: int = field(init=False, default=0)

    def __post_init__(self) -> None:
        self.name, self.environment = self.inner.name, self.inner.environment

    def reset(self, n: int) -> None:
        """Begin n episodes without the fault."""
        self._decisions, self._n = 0, n
        self.inner.reset(n)

    def act(self, observations: NDArray) -> NDArray:
        """Actions for observations (n, entries); before decision `first` the memory is erased."""
        if self._decisions == self.first:
            self.inner.reset(self._n)
        self._decisions += 1
        return self.inner.act(observations)
