"""Faults of the control unit, worn around a controller: the controller knows nothing of them.

Only controllers that work from measurements can be wrapped: a privileged one reads no sensor.
"""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from controllers.base import Controller
from epv_env.observation import INDEX, P3_LAGS

_P3 = INDEX["p3"]
_P3_CHANGES = [INDEX[f"p3_change_{lag}"] for lag in P3_LAGS]


class Fault(Protocol):
    """Makes a controller suffer from something."""

    def around(self, controller: Controller, period: float) -> Controller:
        """The controller with the fault; period: time between its decisions [s]."""
        ...


@dataclass(frozen=True, kw_only=True)
class FrozenP3:
    """The reading of p3 stops changing."""

    at: float
    """Time since the episode's start [s]."""

    def around(self, controller: Controller, period: float) -> Controller:
        return _WithFrozenP3(inner=controller, first=round(self.at / period))


@dataclass(frozen=True, kw_only=True)
class Restart:
    """The control unit restarts: the controller forgets everything, and the plant goes on."""

    at: float
    """Time since the episode's start [s]."""

    def around(self, controller: Controller, period: float) -> Controller:
        return _Restarted(inner=controller, first=round(self.at / period))


@dataclass
class _Wrapped:
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


@dataclass
class _WithFrozenP3(_Wrapped):
    _held: NDArray = field(init=False, default_factory=lambda: np.zeros(0))

    def act(self, observations: NDArray) -> NDArray:
        """Actions for observations (n, entries), of which p3 is held from `first` on."""
        if self._decisions == self.first:
            self._held = observations[:, _P3].copy()
        if self._decisions >= self.first:
            observations = observations.copy()
            observations[:, _P3] = self._held
            observations[:, _P3_CHANGES] = 0.0  # their centre is 0: no change
        self._decisions += 1
        return self.inner.act(observations)


@dataclass
class _Restarted(_Wrapped):
    def act(self, observations: NDArray) -> NDArray:
        """Actions for observations (n, entries); before decision `first` the memory is erased."""
        if self._decisions == self.first:
            self.inner.reset(self._n)
        self._decisions += 1
        return self.inner.act(observations)
