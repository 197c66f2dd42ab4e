"""The protocol by which the diagnosis knows a plant, and the records that describe it.

Every value is in SI. A plant has channels, recorded runs, calibrated parameters, a catalogue of causes,
nuisance parameters, state equations, and a simulator of several candidates side by side.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class PlantError(ValueError):
    """A plant or its recordings cannot be diagnosed; one sentence per finding, one finding per line."""


@dataclass(frozen=True, kw_only=True)
class Channel:
    """One measured output."""

    name: str
    unit: str
    """Unit in which reports show the channel."""
    scale: float
    """Size of that unit in SI."""
    noise: float | None = None
    """Standard deviation of the readings about the true value [SI]; None where nobody knows it: the
    readings then show it."""
    resolution: float = 0.0
    """Step between the values that a reading can take (encoder, converter, bus) [SI]; 0 for none."""

    @property
    def known_noise(self) -> float:
        """`noise`, where it must be known [SI]: a `prepared` plant knows it of every channel.

        Raises ValueError where it is None.
        """
        if self.noise is None:
            raise ValueError(
                f"channel {self.name}: its noise is None, but residuals are weighed by it: call "
                "prepared(plant), which estimates it"
            )
        return self.noise


@dataclass(frozen=True, kw_only=True)
class Run:
    """One recording as the diagnosis sees it."""

    name: str
    held_out: bool
    """No fit uses a held-out run: the gap and its reduction are judged on these runs."""
    time: NDArray
    """Sampling instants, uniform, (samples,) [s]; they need not begin at 0."""
    measured: NDArray
    """Readings, (channels, samples) [SI]."""
    trusted: NDArray
    """Readings that count, boolean, (channels, samples); a reading at a switching instant does not, nor
    one that a slower channel lacks. What does not count may be NaN; NaN that counts is a dropout."""
    inputs: Mapping[str, NDArray]
    """Signals that act on the plant, by name, (samples,) [SI], for figures and the black box."""


@dataclass(frozen=True, kw_only=True)
class FreeParameter:
    """A number that a fit may change: a calibrated parameter, or a parameter of a cause."""

    symbol: str
    unit: str
    low: float
    """One end of the physical range [SI]."""
    high: float
    """The other end of the physical range [SI]."""
    nominal: float = 0.0
    """Value in the nominal model [SI]."""
    trials: tuple[float, ...] = ()
    """Values [SI] from which the search for a cause begins; () for a calibrated parameter, whose search
    begins at `nominal`."""
    meaning: str = ""
    """What the parameter is, in words; empty where the symbol says it."""
    scale: float = math.nan
    """Usual size [SI], not 0; the optimiser works with value/scale. Left out: `usual_size`."""
    sd: float = math.inf
    """Standard deviation of its Gaussian prior [SI]; infinity for none."""
    mean: float = math.nan
    """Mean of that prior [SI]. Left out: `nominal`."""

    def __post_init__(self):
        """Give a parameter without scale and mean its own, so that both are numbers."""
        for name, own in (("scale", self.usual_size), ("mean", self.nominal)):
            if math.isnan(getattr(self, name)):
                object.__setattr__(self, name, own)

    @property
    def title(self) -> str:
        """The parameter for people."""
        return f"{self.meaning} ({self.symbol})" if self.meaning else self.symbol

    @property
    def usual_size(self) -> float:
        """Magnitude of the nominal value; else of the first trial; else a tenth of the range [SI].

        Never 0: the optimiser divides by it.
        """
        first_trial = abs(self.trials[0] - self.nominal) if self.trials else 0.0
        return abs(self.nominal) or first_trial or abs(self.high - self.low) / 10 or 1.0


@dataclass(frozen=True, kw_only=True)
class NuisanceParameter:
    """A number with a Gaussian prior that is neither calibrated nor part of a gap."""

    symbol: str
    sd: float
    """Standard deviation about `centre` [SI]."""
    centre: float = 0.0
    """Expected value [SI]."""
    step: float
    """Change for a finite difference [SI]."""


@dataclass(frozen=True, kw_only=True)
class Cause:
    """One way in which the nominal model may be wrong."""

    name: str
    """Name as in the catalogue; all variants of a cause share the name."""
    component: str
    """Component of the plant in which the cause lies."""
    parameters: tuple[FreeParameter, ...]
    """Parameters that are fitted when the cause acts; at their nominal values it does not act."""
    run_parameters: tuple[NuisanceParameter, ...] = ()
    """Nuisance parameters of the cause that take a separate value in every run."""
    prior: float = 1.0
    """Probability before any data, relative to the other causes."""
    variant: str = ""
    """Which of several forms of the cause this is; empty where there is one form."""
    words: str = ""
    """What people read instead of a name that they cannot know; empty where the name says it."""
    exact_form: bool = False
    """True where the cause has no law but its own: a parameter of the model that is off, an offset."""

    @property
    def sizes(self) -> tuple[FreeParameter, ...]:
        """Parameters without which the cause does not act; the others say how its form departs."""
        return tuple(parameter for parameter in self.parameters if parameter.trials)

    @property
    def label(self) -> str:
        """Name and variant, as in files."""
        return f"{self.name} ({self.variant})" if self.variant else self.name

    @property
    def title(self) -> str:
        """The cause for people: its words, and its name in brackets."""
        words = f"{self.words}, {self.variant}" if self.variant else self.words
        return f"{words} ({self.name})" if self.words else self.label


@dataclass(frozen=True, kw_only=True)
class StateEquation:
    """One state equation. The diagnosis adds a forcing where physics may be missing."""

    name: str
    state: str
    """State whose rate the equation gives, as named in `GreyBox.states`."""
    component: str
    unit: str
    """Unit of the forcing in reports."""
    scale: float = 1.0
    """Size of that unit in SI."""
    meaning: str = ""
    """The equation in words, as in 'balance of the air'; empty where the name says it."""
    step: float
    """Forcing for a finite difference [SI]; 0 for an identity such as x' = v, which lacks nothing."""

    @property
    def title(self) -> str:
        """The equation for people."""
        return f"{self.meaning} ({self.name})" if self.meaning else self.name


@dataclass(frozen=True, kw_only=True)
class StateTrace:
    """A state of the model, or a function of its states and inputs, over a run."""

    unit: str
    """Unit in reports."""
    scale: float
    """Size of that unit in SI."""
    values: NDArray
    """Time course, (samples,) [SI]."""


class GreyBox(Protocol):
    """A plant with recordings. Values are SI; n candidates are simulated side by side.

    Candidate values are a mapping from symbol to an array: (n,), or (n, runs) for a parameter that takes
    a separate value in every run. A symbol that is left out has its nominal value.

    Some members are optional. `with_runs(runs)` is the plant with other readings and inputs of its runs:
    without it, a wild sample of an input is refused. `screened` are the faulty readings of a plant that
    has screened its own recordings (`identification.gap.prepare.screened`).
    `law_values(number, cause, argument, low, high, growth)` gives values by symbol [SI] with which
    `outputs` simulates law `number`, from 1 on, of a cause: its strength times 1 + g, where g is linear
    between the knots `growth`, equally spaced from `low` to `high` of one of the states in
    `law_arguments`, and constant beyond. Without it, all causes have the laws that are assumed.
    `law_states(values, run)` gives these states as `states` does; without it they are among `states`.
    """

    @property
    def channels(self) -> Sequence[Channel]:
        """Measured outputs, in the order of the first axis of every output array."""
        ...

    @property
    def runs(self) -> Sequence[Run]:
        """Recordings; at least one of them is held out."""
        ...

    @property
    def parameters(self) -> Sequence[FreeParameter]:
        """Calibrated parameters; calibration begins at their nominal values."""
        ...

    @property
    def causes(self) -> Sequence[Cause]:
        """Catalogue of what may be wrong with the model."""
        ...

    @property
    def tolerances(self) -> Sequence[NuisanceParameter]:
        """Other parameters with their scatter from unit to unit; the same in every run."""
        ...

    @property
    def run_offsets(self) -> Sequence[NuisanceParameter]:
        """Nuisance parameters with a value per run: initial states, zeros of that day's sensors."""
        ...

    def outputs(self, values: Mapping[str, NDArray], runs: Sequence[int]) -> list[NDArray]:
        """Simulate the runs with the given indices.

        Args:
            values: candidate values by symbol, (n,) or (n, runs) [SI].
            runs: indices into `self.runs`.

        Returns:
            Model outputs of each of these runs, (channels, samples, n) [SI]; NaN where it fails.
        """
        ...

    @property
    def equations(self) -> Sequence[StateEquation]:
        """The model's state equations."""
        ...

    def states(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, StateTrace]:
        """States that a missing term may depend on, by name.

        values: by symbol, (n,) or (n, runs) [SI]; the first candidate counts. run: index of the run.
        """
        ...

    def regimes(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, NDArray]:
        """Samples in each regime of the model, boolean (samples,) by name; regimes may overlap.

        values: by symbol, (n,) or (n, runs) [SI]; the first candidate counts. run: index of the run.
        """
        ...

    def forced(self, values: Mapping[str, NDArray], run: int, forcing: Mapping[str, NDArray]) -> NDArray:
        """Changes of the outputs under m forcings side by side.

        Args:
            values: values of one candidate by symbol, (1,) or (1, runs) [SI].
            run: index into `self.runs`.
            forcing: what is added to the equations, (samples, m) [SI] by name of the equation; a value
                holds until the next sample.

        Returns:
            Changes of the outputs, (channels, samples, m) [SI].
        """
        ...


def window_forcing(equation: StateEquation, samples: int, edges: NDArray) -> dict[str, NDArray]:
    """A forcing of the equation's step in each window, (samples, windows) by the equation's name.

    edges: first sample of each window, and the end of the last one, (windows + 1,).
    """
    window = np.searchsorted(edges, np.arange(samples), side="right")[:, None] - 1
    return {equation.name: equation.step * (window == np.arange(len(edges) - 1))}


def noise_weighted(plant: GreyBox, run: int, values: NDArray) -> NDArray:
    """Values (channels, samples, ...) [SI] in noise standard deviations, 0 at untrusted readings.

    A channel with a ripple is filtered so that its noise is white.

    Raises ValueError where the noise of a channel is not known: see `prepared`.
    """
    trusted = plant.runs[run].trusted
    noise = np.array([channel.known_noise for channel in plant.channels])
    mask = trusted / noise[:, None]
    weighted = values * mask.reshape(*mask.shape, *[1] * (values.ndim - 2))
    weighted[~trusted] = 0.0  # NaN times 0 is NaN
    for c, ripple in enumerate(getattr(plant, "ripples", ())):
        if ripple:
            weighted[c] = ripple.whitened(weighted[c])
            weighted[c, ~trusted[c]] = 0.0
    return weighted
