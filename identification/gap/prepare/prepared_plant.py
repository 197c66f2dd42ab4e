"""A plant as the stages of the diagnosis need it: screened, noise known, every reading a number."""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.gap.plant import Cause, Channel, GreyBox, PlantError, Ripple, Run, StateTrace
from identification.gap.prepare.noise import channel_noise
from identification.gap.prepare.screened import Finding, bridged, screen


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
