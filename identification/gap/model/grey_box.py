"""The protocol by which the diagnosis knows a plant: channels, parameters, causes, a simulator."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class Channel:
    """One measured output."""

    name: str
    unit: str
    """In which people read it."""
    scale: float
    """Size of that unit in SI."""
    noise: float
    """Standard deviation of the readings about the true value [SI], from the recordings themselves."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """One recording as the diagnosis sees it."""

    name: str
    held_out: bool
    """Never fitted to: the gap and its shrinking are judged on these runs."""
    time: NDArray
    """(samples,) [s]."""
    measured: NDArray
    """(channels, samples) [SI]."""
    trusted: NDArray
    """Which readings count, boolean (channels, samples): not those of the instant of a switching."""
    inputs: Mapping[str, NDArray]
    """What acts on the plant, (samples,) by name [SI], for figures and the black box."""


@dataclass(frozen=True, kw_only=True)
class Size:
    """A number that may be fitted: a parameter of the model, or what sizes a cause."""

    symbol: str
    unit: str
    low: float
    high: float
    """Ends of the physical range [SI]."""
    off: float = 0.0
    """Value in the nominal model."""
    trials: tuple[float, ...] = ()
    """Values from which a search for a cause's size begins; () for a parameter: from `off`."""
    scale: float = 1.0
    """Usual size, by which an optimiser sees it divided."""


@dataclass(frozen=True, kw_only=True)
class Nuisance:
    """What no recording tells exactly and is no gap either: known up to a standard deviation."""

    symbol: str
    sd: float
    """Standard deviation about `centre` [SI]."""
    centre: float = 0.0
    step: float
    """Change for a finite difference [SI]."""


@dataclass(frozen=True, kw_only=True)
class Cause:
    """One way in which the nominal model may be wrong."""

    name: str
    """As in the catalogue; several variants of a cause share it."""
    component: str
    sizes: tuple[Size, ...]
    local: tuple[Nuisance, ...] = ()
    """Numbers of the cause that every run has its own of."""
    prior: float = 1.0
    """Probability before any data, relative to the other causes."""
    variant: str = ""
    exact: bool = False
    """Its form is not in doubt: a number of the model that is off."""

    @property
    def label(self) -> str:
        """Name and variant."""
        return f"{self.name} ({self.variant})" if self.variant else self.name


@dataclass(frozen=True, kw_only=True)
class Equation:
    """One state equation, to which a forcing may be added where physics is missing."""

    name: str
    state: str
    """Whose rate it gives, as in `GreyBox.states`."""
    component: str
    unit: str
    """Of the forcing, as people read it."""
    scale: float = 1.0
    """Size of that unit in SI."""
    step: float
    """Forcing for a finite difference [SI]; 0 for an identity such as x' = v, which lacks nothing."""


@dataclass(frozen=True, kw_only=True)
class Trace:
    """A state of the model, or what follows from its states and inputs, over a run."""

    unit: str
    """In which people read it."""
    scale: float
    """Size of that unit in SI."""
    values: NDArray
    """(samples,) [SI]."""


class GreyBox(Protocol):
    """A plant with recordings. Values are SI; n candidates are simulated side by side."""

    @property
    def channels(self) -> Sequence[Channel]:
        """Measured outputs, in the order of every array of outputs."""
        ...

    @property
    def runs(self) -> Sequence[Run]:
        """Recordings."""
        ...

    @property
    def parameters(self) -> Sequence[Size]:
        """What calibration fits; `off` is where it starts."""
        ...

    @property
    def causes(self) -> Sequence[Cause]:
        """What may be wrong with the model."""
        ...

    @property
    def tolerances(self) -> Sequence[Nuisance]:
        """Other parameters, with the scatter of a unit that is as drawn; the same in every run."""
        ...

    @property
    def starts(self) -> Sequence[Nuisance]:
        """What every run has its own of: state at the start, zero of a sensor on that day."""
        ...

    def outputs(self, values: Mapping[str, NDArray], runs: Sequence[int]) -> list[NDArray]:
        """Model outputs for each of the runs (indices), (channels, samples, n); NaN where it fails.

        values: by symbol, (n,), or (n, runs) for what every run has its own of; a symbol that is left
        out has its nominal value.
        """
        ...

    @property
    def equations(self) -> Sequence[Equation]:
        """The model's state equations."""
        ...

    def states(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, Trace]:
        """What a missing term may depend on, from the model at one candidate's values, by name."""
        ...

    def regimes(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, NDArray]:
        """In which regime the model is, boolean (samples,) by name; regimes may overlap."""
        ...

    def forced(
        self, values: Mapping[str, NDArray], equation: Equation, run: int, edges: NDArray
    ) -> NDArray:
        """Change of the outputs by the equation's step as a forcing, (channels, samples, windows).

        edges: first samples of the windows in which each acts alone, and the end, (windows + 1,).
        """
        ...


def weighted(plant: GreyBox, run: int, values: NDArray) -> NDArray:
    """Values (channels, samples, ...) in noise deviations, 0 where readings are not trusted."""
    noise = np.array([channel.noise for channel in plant.channels])
    mask = plant.runs[run].trusted / noise[:, None]
    return values * mask.reshape(*mask.shape, *[1] * (values.ndim - 2))
