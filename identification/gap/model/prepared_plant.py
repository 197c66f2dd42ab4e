"""A plant as the stages of the diagnosis need it: noise known, time from 0, every reading a number."""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identification.gap.model.grey_box import GreyBox
from identification.gap.model.noise_level import STEP_TO_SD, quantisation_step, white_noise
from identification.gap.model.plant_error import PlantError
from identification.gap.model.recorded_run import Channel, Run
from identification.gap.model.settings import PreparationSettings
from identification.gap.model.state_equation import StateEquation, StateTrace

NoiseSource = Literal["given", "estimated", "resolution"]
"""Where a channel's noise comes from: the user, the readings, or the step between possible readings."""

class PreparedPlant:
    """`GreyBox` that adds to a plant what its owner may leave out; the plant itself still simulates."""

    def __init__(self, plant: GreyBox, settings: PreparationSettings):
        """Estimate what is not given.

        Args:
            plant: a plant that passes `check`.
            settings: how noise is estimated.

        Raises:
            PlantError: a channel's noise is neither given nor seen in its readings.
        """
        self.plant = plant
        self.parameters, self.causes = tuple(plant.parameters), tuple(plant.causes)
        self.tolerances, self.run_offsets = tuple(plant.tolerances), tuple(plant.run_offsets)
        self.equations = tuple(plant.equations)
        noise = [_noise(plant, c, settings) for c in range(len(plant.channels))]
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
            channel.name: source if ratio == 1 else "estimated"
            for (channel, ratio), source in zip(
                zip(self.channels, ratios, strict=True), self.noise_source.values(), strict=True
            )
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


def prepared(plant: GreyBox, settings: PreparationSettings | None = None) -> PreparedPlant:
    """The plant with a positive noise in every channel, runs from time 0 and readings that are numbers.

    A plant that is prepared already is returned as it is. An untrusted reading that is no number lies
    between its trusted neighbours afterwards; nothing weighs it, but figures may show it.

    Args:
        plant: a plant that passes `check`.
        settings: how noise is estimated; None: the defaults.

    Raises:
        PlantError: a channel's noise is neither given nor seen in its readings.
    """
    if isinstance(plant, PreparedPlant):
        return plant
    return PreparedPlant(plant, settings or PreparationSettings())


def _noise(plant: GreyBox, c: int, settings: PreparationSettings) -> tuple[float, NoiseSource]:
    """Noise of channel number c [SI] and where it comes from."""
    channel = plant.channels[c]
    if channel.noise is not None:
        floor = STEP_TO_SD * channel.resolution
        return (channel.noise, "given") if channel.noise >= floor else (floor, "resolution")
    series = [run.measured[c][run.trusted[c]] for run in plant.runs]
    floor = STEP_TO_SD * (channel.resolution or quantisation_step(series, settings))
    level = white_noise(series, settings)
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
