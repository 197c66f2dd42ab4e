"""Detection of gaps by their size."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from identification.studies.blind.kinds import ABSORBED, ONE_CAUSE, TWO_EFFECTS
from identification.studies.blind.score import TrialScore
from identification.studies.blind.settings import DEFAULTS, BlindSettings
from identification.studies.blind.summary import is_alarmed, of_kind
from identification.studies.proportion import Proportion


@dataclass(frozen=True, kw_only=True)
class DetectionBin:
    """Trials with similar explainable gaps."""

    low: float
    """Least gap above the floor of 1 [-]."""
    high: float
    """Largest gap above the floor of 1 [-]."""
    detected: Proportion
    """Trials in which the diagnosis finds a gap."""
    first_cause_correct: Proportion
    """Trials in which the most probable cause is correct."""


def detection_by_gap(
    trials: Sequence[TrialScore], settings: BlindSettings = DEFAULTS
) -> list[DetectionBin]:
    """Detection by explainable gap, for trials with one cause or two effects.

    Absorbed trials are included: below the threshold the diagnosis should find nothing.
    """
    caused = of_kind(trials, ONE_CAUSE, TWO_EFFECTS, ABSORBED)
    edges = settings.gap_bins
    indices = np.digitize([max(t.explainable_gap - 1.0, edges[0]) for t in caused], edges)
    bins = []
    for index, (low, high) in enumerate(pairwise(edges), start=1):
        inside = [trial for trial, bin_ in zip(caused, indices, strict=True) if bin_ == index]
        bins.append(
            DetectionBin(
                low=low,
                high=high,
                detected=Proportion.count(inside, is_alarmed),
                first_cause_correct=Proportion.count(inside, lambda t: t.first_cause_correct),
            )
        )
    return bins
