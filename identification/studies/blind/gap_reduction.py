"""What a diagnosis says of gaps, checked by replay on the noise-free truth."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from epv_env.plant.parameters import Parameters
from identification.studies.blind.answers import NAMING_VERDICTS, is_correct
from identification.studies.blind.noise_free_gap import (
    NoiseFreeRecording,
    held_out_gap,
    hypothesis_distance,
)
from identification.studies.blind.settings import DEFAULTS, BlindSettings
from identification.studies.blind.size_estimates import estimated_sizes


@dataclass(frozen=True, kw_only=True)
class GapReduction:
    """The share of the gap that the diagnosed cause removes."""

    true: float
    """By replay of the reported parameters on the noise-free held-out recordings [-]."""
    low: float
    """Lower end of the diagnosed interval [-]."""
    high: float
    """Upper end of the diagnosed interval [-]."""

    @property
    def inside(self) -> bool:
        """Whether the diagnosed interval holds the true share."""
        return self.low <= self.true <= self.high


def true_gap_reduction(
    diagnosis: Mapping[str, Any] | None,
    truth: Sequence[NoiseFreeRecording],
    settings: BlindSettings = DEFAULTS,
) -> GapReduction | None:
    """Share of the recalibrated gap that the first cause removes, on noise-free held-out recordings.

    Both gaps are those of the reported parameters, replayed. None where no cause is named with an
    interval, or where recalibration leaves too small a gap.
    """
    if diagnosis is None or diagnosis["verdict"] not in NAMING_VERDICTS or not diagnosis["causes"]:
        return None
    cause = diagnosis["causes"][0]
    said, parameters = cause.get("shrink") or {}, diagnosis.get("parameters", {})
    if said.get("low") is None or said.get("high") is None or not parameters.get("with_cause"):
        return None
    before = held_out_gap(truth, _plant_values(parameters["recalibrated"]), settings)
    if before - 1.0 < settings.smallest_gap:
        return None
    with_cause = {**estimated_sizes(cause), **parameters["with_cause"]}
    after = held_out_gap(truth, _plant_values(with_cause), settings)
    return GapReduction(true=(before - after) / (before - 1.0), low=said["low"], high=said["high"])


def rival_distance(
    label: Mapping[str, Any],
    diagnosis: Mapping[str, Any] | None,
    truth: Sequence[NoiseFreeRecording],
    settings: BlindSettings = DEFAULTS,
) -> float | None:
    """Distance of the nearest wrong cause in the truth's ambiguity set [noise deviations].

    A cause that holds all of the truth is no rival: with its other effects at zero it equals the truth.
    None where the set does not hold the truth, or has no rival.
    """
    if diagnosis is None or diagnosis["verdict"] != "ambiguous":
        return None
    ambiguity_set = diagnosis["ambiguity_set"]
    members = [cause for cause in diagnosis["causes"] if cause["effects"] in ambiguity_set]
    if not any(is_correct(label, cause["effects"]) for cause in members):
        return None
    rivals = [cause for cause in members if not set(label["visible"]) <= set(cause["effects"])]
    starts = [estimated_sizes(cause) for cause in rivals]
    distances = (hypothesis_distance(truth, start, settings) for start in starts if all(start.values()))
    return min(distances, default=None)


def _plant_values(values: Mapping[str, Any]) -> dict[str, float]:
    """Values of the plant's own parameters [SI]; a diagnosis may report more."""
    return {symbol: float(values[symbol]) for symbol in Parameters.calibrated() if symbol in values}
