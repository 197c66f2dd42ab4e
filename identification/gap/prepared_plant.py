"""A plant as the stages of the diagnosis need it: noise known, time from 0, every reading a number.

White noise shows in differences of neighbouring readings (Rice 1984; second differences: Gasser, Sroka
and Jennen-Steinmetz 1986), a smooth course hardly does. The median over blocks leaves out where it moves
fast. Readings in coarse steps may not differ at all: then the step tells how far they may be off.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from math import comb
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identification.gap.plant import Channel, GreyBox, PlantError, Run, StateEquation, StateTrace

BLOCK_READINGS = 20
"""Length of a block whose noise is estimated by itself [readings]: four blocks in a run of 80 readings,
and motion in some of them does not move the median."""

DIFFERENCE_ORDERS = (2, 4)
"""Orders of the differences of neighbouring readings that show the noise; the least estimate counts. The
second suffices for finely sampled runs; the fourth removes the motion of runs with a few dozen readings
per transient as well."""

LARGEST_ROUNDING = 1e-9
"""Distance of two readings that is rounding of the same value, relative to all readings' range [1]."""

STEP_QUANTILE = 0.1
"""Quantile of the distances of neighbouring values that is tried as the step of a quantised channel [1]:
most values of a range occur, so that a small quantile is one step."""

STEP_TOLERANCE = 0.05
"""Distance of a difference from the next multiple of the step up to which it is one [steps]."""

SHARE_OF_MULTIPLES = 0.95
"""Share of differences that must be multiples of the step [1]: all but faulty readings."""

FEWEST_DISTANCES = 4
"""Fewest distances of neighbouring values that can show a step: by chance two may be alike."""

STEP_TO_SD = float(np.sqrt(1.0 / 12.0))
"""Standard deviation of rounding to a step, in steps."""


def white_noise(series: Sequence[NDArray]) -> float:
    """Standard deviation of white noise on readings about a smooth course.

    Args:
        series: consecutive trusted readings of each run, (readings,) [unit of the readings].

    Returns:
        In the unit of the readings; 0 where most neighbours are equal, NaN where no run has enough
        readings.
    """
    levels = [_from_differences(series, order) for order in DIFFERENCE_ORDERS]
    known = [level for level in levels if not np.isnan(level)]
    return min(known, default=float("nan"))


def quantisation_step(series: Sequence[NDArray]) -> float:
    """Step of which all readings are multiples, but for an offset.

    series: readings of each run, (readings,) [unit of the readings]. Returns the step in the unit of the
    readings, 0 where there is none.
    """
    values = np.unique(np.concatenate([np.zeros(0), *series]))
    if len(values) < 2:
        return 0.0
    gaps = np.diff(values)
    gaps = gaps[gaps > LARGEST_ROUNDING * (values[-1] - values[0])]
    if len(gaps) < FEWEST_DISTANCES:
        return 0.0
    step = float(np.quantile(gaps, STEP_QUANTILE, method="lower"))
    multiples = gaps / step
    close = np.abs(multiples - np.round(multiples)) <= STEP_TOLERANCE
    return step if np.mean(close) >= SHARE_OF_MULTIPLES else 0.0


def _from_differences(series: Sequence[NDArray], order: int) -> float:
    """Noise by differences of one order; NaN where no run has enough readings."""
    scale = 1.0 / np.sqrt(comb(2 * order, order))  # root of the sum of squared binomial coefficients
    blocks = [
        block
        for readings in series
        if len(readings) > order
        for block in _blocks(scale * np.diff(readings, order), BLOCK_READINGS)
    ]
    if not blocks:
        return float("nan")
    freedom = min(len(block) for block in blocks) / _correlated_readings(order)
    return noise_of_blocks([float(np.mean(block**2)) for block in blocks], max(freedom, 1.0))


def noise_of_blocks(variances: NDArray | Sequence[float], freedom: float) -> float:
    """Standard deviation of white noise from its variance in blocks of readings, a few of them lively.

    variances: (blocks,). freedom: independent values in a block. The median of a chi-square variable
    becomes its mean (Wilson and Hilferty 1931).
    """
    return float(np.sqrt(np.median(variances) / (1.0 - 2.0 / (9.0 * freedom)) ** 3))


def _blocks(differences: NDArray, length: int) -> list[NDArray]:
    """Differences (readings,) in blocks of at least this length, or in one block."""
    return np.array_split(differences, max(1, len(differences) // length))


def _correlated_readings(order: int) -> float:
    """Number of differences of white noise that tell as much as one independent value."""
    weights = np.diff(np.eye(1, 2 * order + 1, order)[0], order)
    correlation = np.correlate(weights, weights, "full") / (weights @ weights)
    return float(np.sum(correlation**2))


NoiseSource = Literal["given", "estimated", "resolution"]
"""Where a channel's noise comes from: the user, the readings, or the step between possible readings."""


class PreparedPlant:
    """`GreyBox` that adds to a plant what its owner may leave out; the plant itself still simulates."""

    def __init__(self, plant: GreyBox):
        """Estimate what is not given.

        Args:
            plant: a plant that passes `check`.

        Raises:
            PlantError: a channel's noise is neither given nor seen in its readings.
        """
        self.plant = plant
        self.parameters, self.causes = tuple(plant.parameters), tuple(plant.causes)
        self.tolerances, self.run_offsets = tuple(plant.tolerances), tuple(plant.run_offsets)
        self.equations = tuple(plant.equations)
        noise = [_noise(plant, c) for c in range(len(plant.channels))]
        self.channels: tuple[Channel, ...] = tuple(
            replace(channel, noise=level)
            for channel, (level, _) in zip(plant.channels, noise, strict=True)
        )
        self.noise_source: Mapping[str, NoiseSource] = {
            channel.name: source for channel, (_, source) in zip(plant.channels, noise, strict=True)
        }
        """Where the noise of each channel comes from."""
        self.time_scale: float | None = getattr(plant, "time_scale", None)
        """Of the plant [s]; None: its readings show it."""
        self.runs: tuple[Run, ...] = tuple(_prepared_run(run) for run in plant.runs)

    def with_noise(self, ratios: Sequence[float]) -> "PreparedPlant":
        """The plant whose channels have their noise times a ratio each, as residuals show it [1]."""
        corrected = copy(self)
        corrected.channels = tuple(
            replace(channel, noise=ratio * channel.known_noise)
            for channel, ratio in zip(self.channels, ratios, strict=True)
        )
        corrected.noise_source = {
            channel.name: self.noise_source[channel.name] if ratio == 1 else "estimated"
            for channel, ratio in zip(self.channels, ratios, strict=True)
        }
        return corrected

    def outputs(self, values: Mapping[str, NDArray], runs: Sequence[int]) -> list[NDArray]:
        """`GreyBox.outputs`: (channels, samples, n) [SI] of each run."""
        return self.plant.outputs(values, runs)

    def states(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, StateTrace]:
        """`GreyBox.states`: values (samples,) [SI] by name."""
        return self.plant.states(values, run)

    def regimes(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, NDArray]:
        """`GreyBox.regimes`: boolean (samples,) by name."""
        return self.plant.regimes(values, run)

    def forced(
        self, values: Mapping[str, NDArray], equation: StateEquation, run: int, edges: NDArray
    ) -> NDArray:
        """`GreyBox.forced`: changes (channels, samples, windows) [SI]."""
        return self.plant.forced(values, equation, run, edges)


def prepared(plant: GreyBox) -> PreparedPlant:
    """The plant with a positive noise in every channel, runs from time 0 and readings that are numbers.

    A plant that is prepared already is returned as it is. An untrusted reading that is no number lies
    between its trusted neighbours afterwards; nothing weighs it, but figures may show it.

    Args:
        plant: a plant that passes `check`.

    Raises:
        PlantError: a channel's noise is neither given nor seen in its readings.
    """
    if isinstance(plant, PreparedPlant):
        return plant
    return PreparedPlant(plant)


def _noise(plant: GreyBox, c: int) -> tuple[float, NoiseSource]:
    """Noise of channel number c [SI] and where it comes from."""
    channel = plant.channels[c]
    if channel.noise is not None:
        floor = STEP_TO_SD * channel.resolution
        return (channel.noise, "given") if channel.noise >= floor else (floor, "resolution")
    series = [run.measured[c][run.trusted[c]] for run in plant.runs]
    floor = STEP_TO_SD * (channel.resolution or quantisation_step(series))
    level = white_noise(series)
    if level > floor:
        return level, "estimated"
    if not floor > 0:
        raise PlantError(
            f"channel {channel.name}: its noise is None, but its trusted readings do not show any "
            "(too few, or most neighbours are equal): give `noise` or `resolution`"
        )
    return floor, "resolution"


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
    samples = np.arange(len(readings))
    if not np.any(trusted):
        return np.zeros(len(readings))
    between = np.interp(samples, samples[trusted], readings[trusted])
    return np.where(np.isfinite(readings), readings, between)
