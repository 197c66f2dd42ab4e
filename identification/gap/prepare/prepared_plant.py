"""A plant as the stages of the diagnosis need it: screened, noise known, every reading a number.

Its time scale is the lag at which the autocorrelation of the readings' changes falls below 1/e: the time
constant of a relaxation, a fifth of an oscillation's period, whatever the inputs do in between. Readings
are averaged over the narrowest width at which their changes stand out of the noise, and the noise's part
is subtracted: white noise does not make a slow plant look fast.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import correlate

from identification.gap.plant import Cause, Channel, GreyBox, PlantError, Run, StateTrace
from identification.gap.prepare.noise import channel_noise
from identification.gap.prepare.screened import Finding, bridged, screen
from identification.noise import Ripple, white_noise


class PreparedPlant:
    """`GreyBox` that adds to a plant what its owner may leave out; the plant itself still simulates."""

    def __init__(self, plant: GreyBox):
        """Screen the recordings, and estimate what is not given.

        Args:
            plant: a plant whose description passes `check_description`.

        Raises:
            PlantError: recordings cannot be used (`screen`), or a channel's noise is neither given nor
                seen in its readings.
        """
        found = getattr(plant, "screened", None)  # a plant that has it has seen to it itself
        runs, self.screened = (
            screen(plant.runs, plant.channels) if found is None else (plant.runs, tuple(found))
        )
        """Faulty readings that no fit uses."""
        self.plant = _with_inputs(plant, runs, self.screened)
        self.parameters, self.causes = tuple(plant.parameters), tuple(plant.causes)
        self.tolerances, self.run_offsets = tuple(plant.tolerances), tuple(plant.run_offsets)
        self.equations = tuple(plant.equations)
        self.channels: tuple[Channel, ...] = tuple(
            replace(
                channel, noise=channel_noise(channel, [run.measured[c][run.trusted[c]] for run in runs])
            )
            for c, channel in enumerate(plant.channels)
        )
        self.law_arguments: tuple[str, ...] = tuple(getattr(plant, "law_arguments", ()))
        """States over which the plant simulates laws; () where it cannot."""
        self.time_scale: float | None = getattr(plant, "time_scale", None)
        """Of the plant [s]; None: its readings show it."""
        self.runs: tuple[Run, ...] = tuple(_prepared_run(run) for run in runs)
        self.ripples: tuple[Ripple | None, ...] = ()
        """By channel, what filters its readings; () where none ripples."""

    def with_noise(self, ratios: Sequence[float]) -> "PreparedPlant":
        """The plant whose channels have their noise times a ratio each, as residuals show it [1]."""
        corrected = copy(self)
        corrected.channels = tuple(
            replace(channel, noise=ratio * channel.known_noise)
            for channel, ratio in zip(self.channels, ratios, strict=True)
        )
        return corrected

    def with_ripples(self, ripples: Sequence[Ripple | None]) -> "PreparedPlant":
        """The plant whose readings are filtered where a channel has a ripple."""
        filtered = copy(self)
        filtered.ripples = tuple(ripples)
        return filtered

    def outputs(self, values: Mapping[str, NDArray], runs: Sequence[int]) -> list[NDArray]:
        """`GreyBox.outputs`: (channels, samples, n) [SI] of each run."""
        return self.plant.outputs(values, runs)

    def states(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, StateTrace]:
        """`GreyBox.states`: values (samples,) [SI] by name."""
        return self.plant.states(values, run)

    def regimes(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, NDArray]:
        """`GreyBox.regimes`: boolean (samples,) by name."""
        return self.plant.regimes(values, run)

    def forced(self, values: Mapping[str, NDArray], run: int, forcing: Mapping[str, NDArray]) -> NDArray:
        """`GreyBox.forced`: changes (channels, samples, m) [SI]."""
        return self.plant.forced(values, run, forcing)

    def law_states(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, StateTrace]:
        """`GreyBox.law_states` by name; the states where the plant has no such method."""
        return getattr(self.plant, "law_states", self.plant.states)(values, run)

    def law_values(
        self, number: int, cause: Cause, argument: str, low: float, high: float, growth: NDArray
    ) -> Mapping[str, float]:
        """`GreyBox.law_values` by symbol [SI]; growth: (knots,)."""
        return self.plant.law_values(number, cause, argument, low, high, growth)  # type: ignore[attr-defined]


def prepared(plant: GreyBox) -> PreparedPlant:
    """The plant with a positive noise in every channel, runs from time 0 and readings that are numbers.

    A plant that is prepared already is returned as it is. An untrusted reading that is no number lies
    between its trusted neighbours afterwards; nothing weighs it, but figures may show it.

    Args:
        plant: a plant whose description passes `check_description`.

    Raises:
        PlantError: recordings cannot be used (`screen`), or a channel's noise is neither given nor seen
            in its readings.
    """
    if isinstance(plant, PreparedPlant):
        return plant
    return PreparedPlant(plant)


def _with_inputs(plant: GreyBox, runs: Sequence[Run], found: Sequence[Finding]) -> GreyBox:
    """The plant that simulates the screened runs. Raises PlantError if it cannot take their inputs."""
    if not found or hasattr(plant, "screened"):
        return plant
    with_runs = getattr(plant, "with_runs", None)
    if with_runs:
        return with_runs(runs)
    outputs = [channel.name for channel in plant.channels]
    wild = [own.place for own in found if own.channel not in outputs]
    if wild:
        raise PlantError(
            f"inputs: wild are {'; '.join(wild)}, and the model runs on them: correct them, or give the "
            "plant a method with_runs(runs) that takes corrected ones"
        )
    return plant


def _prepared_run(run: Run) -> Run:
    """A run from time 0 whose readings are numbers; the same record where it is so already."""
    missing = ~np.isfinite(run.measured)
    if run.time[0] == 0 and not np.any(missing):
        return run
    filled = [
        _filled(readings, trusted) if np.any(lost) else readings
        for readings, trusted, lost in zip(run.measured, run.trusted, missing, strict=True)
    ]
    return replace(run, time=run.time - run.time[0], measured=np.array(filled))


def _filled(readings: NDArray, trusted: NDArray) -> NDArray:
    """Readings (samples,) with a straight line between trusted neighbours where they are no number."""
    if not np.any(trusted):
        return np.zeros(len(readings))
    between = bridged(readings, np.flatnonzero(~trusted))
    return np.where(np.isfinite(readings), readings, between)


FEWEST_WIDTHS = 8
"""Fewest averaging widths that the shortest run must hold [1]: fewer show no course."""


def time_scale(plant: GreyBox) -> float:
    """Shortest time in which the plant's motion changes its course [s], at least one sampling period.

    Args:
        plant: its attribute `time_scale` [s] counts where it has one; else its readings do.

    Raises:
        ValueError: the plant's own time scale is not positive.
    """
    given = getattr(plant, "time_scale", None)
    if given is not None:
        if not (np.isfinite(given) and given > 0):
            raise ValueError(
                f"the plant's time_scale is {given}: give a positive time in s, or leave it out"
            )
        return float(given)
    period = min(float(run.time[1] - run.time[0]) for run in plant.runs)
    scales = [_channel_scale(plant, c) for c in range(len(plant.channels))]
    seen = [scale for scale in scales if scale is not None]
    # A plant that stands still: some hundred stretches tell chance from rule.
    still = 0.01 * min(float(run.time[-1] - run.time[0]) for run in plant.runs)
    return max(period, min(seen, default=still))


def _channel_scale(plant: GreyBox, channel: int) -> float | None:
    """Time scale of one channel [s]; None where it shows no motion.

    A channel that is read at every tenth sample only is taken at its own period.
    """
    series, spacings, period = [], [], 0.0
    for run in plant.runs:
        counted = np.flatnonzero(run.trusted[channel] & np.isfinite(run.measured[channel]))
        if len(counted) > FEWEST_WIDTHS:
            series.append(run.measured[channel, counted])
            spacings.append(np.diff(counted))
            period = max(period, float(run.time[1] - run.time[0]))
    if not series:
        return None
    noise = min(plant.channels[channel].known_noise, white_noise(series))
    lag = _correlation_lag(series, noise)
    return None if lag is None else lag * period * float(np.median(np.concatenate(spacings)))


def _correlation_lag(series: Sequence[NDArray], noise: float) -> float | None:
    """Lag at which the autocorrelation of the changes falls below 1/e [readings].

    None where the changes do not stand out of the noise. series: per run (readings,) [SI]. noise:
    standard deviation [SI].
    """
    width = _averaging_width(series, noise)
    if width is None:
        return None
    changes = [_changes(y, width) for y in series]
    longest = max(len(own) for own in changes)
    total = np.zeros(longest)
    for own in changes:
        total[: len(own)] += correlate(own, own)[len(own) - 1 :]
    lags = np.arange(longest)
    of_noise = noise**2 * (
        2 * _overlap(lags, width) - _overlap(lags - width, width) - _overlap(lags + width, width)
    )
    left = total - sum(len(own) for own in changes) * of_noise
    below = np.flatnonzero(left < left[0] / np.e)
    if left[0] <= 0 or not len(below):
        return None
    after = int(below[0])
    fraction = (left[after - 1] - left[0] / np.e) / (left[after - 1] - left[after])
    return float(after - 1 + fraction)


def _averaging_width(series: Sequence[NDArray], noise: float) -> int | None:
    """Narrowest width [readings] at which changes stand clearly out of the noise, or about as clearly
    as at any width; None where they never do."""
    widest = min(len(y) for y in series) // FEWEST_WIDTHS
    widths = [1]
    while widths[-1] < widest:
        widths.append(max(widths[-1] + 1, round(1.25 * widths[-1])))
    squares = [np.mean(np.concatenate([_changes(y, w) for y in series]) ** 2) for w in widths]
    # Readings that stand still without noise have neither.
    expected = np.maximum(2 * noise**2 / np.array(widths), np.finfo(float).tiny)
    clearness = np.array(squares) / expected
    # A hundred are enough even where the noise is three times as large as the plant says.
    enough = min(100.0, 0.5 * float(np.max(clearness)))
    if np.max(clearness) < 3.0:  # which noise reaches by chance
        return None
    return widths[int(np.argmax(clearness >= enough))]


def _changes(readings: NDArray, width: int) -> NDArray:
    """Differences of the means of adjacent stretches of `width` of the readings (readings,) [SI]."""
    sums = np.concatenate([[0.0], np.cumsum(readings - readings[0])])
    means = (sums[width:] - sums[:-width]) / width
    return means[width:] - means[:-width]


def _overlap(lags: NDArray, width: int) -> NDArray:
    """Correlation of two means over `width` readings of unit white noise, by their lag (lags,) [1]."""
    return np.maximum(0.0, 1.0 - np.abs(lags) / width) / width
