"""Calibration: do statements of probability p come true in a share p of the cases?

The expected calibration error is the mean over all answers of the distance between the stated
probability and the share that came true, both averaged over bins (Naeini et al. 2015, Guo et al. 2017):

    ECE = sum over bins of (answers in the bin/all answers) |mean probability - share right|

Bins of equal width divide [0, 1]; bins of equal mass divide the sorted answers into equal numbers.
Chance alone lifts the error of a perfectly calibrated judge above 0, the more the fewer answers a bin
has.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.studies.blind.answers import NAMING_VERDICTS
from identification.studies.blind.score import Answer, TrialScore
from identification.studies.blind.settings import DEFAULTS, BlindSettings
from identification.studies.proportion import Proportion

FIRST, LISTED, INCLUSION = "first cause", "first cause as listed", "inclusion of an effect"
"""Statements whose probabilities are compared with what was true.

FIRST: the first listed cause, where the verdict names a cause. LISTED: the same, whatever the verdict.
INCLUSION: each effect of at least `least_inclusion`, whatever the verdict. A cause is right as
`answers.is_true` says, so without a right cause (no effect, effect struck) every answer is wrong.
"""

EQUAL_WIDTH, EQUAL_MASS = "equal width", "equal mass"
"""How answers are binned. The acceptance criterion is that of FIRST with EQUAL_WIDTH."""


@dataclass(frozen=True, kw_only=True)
class CalibrationError:
    """Expected calibration error with its bootstrap interval."""

    value: float
    """Of all answers [-]."""
    low: float
    """Lower end of the 95 % interval [-]."""
    high: float
    """Upper end of the 95 % interval [-]."""


@dataclass(frozen=True, kw_only=True)
class ReliabilityBin:
    """Answers of similar probability."""

    mean_probability: float
    """Of the answers [-]."""
    right: Proportion
    """Answers that came true."""


def answers_by_trial(trials: Sequence[TrialScore]) -> dict[str, list[list[Answer]]]:
    """Answers of each trial by statement (FIRST, LISTED, INCLUSION); trials without any are left out."""
    found = {
        FIRST: [[t.listed] for t in trials if t.listed and t.verdict in NAMING_VERDICTS],
        LISTED: [[t.listed] for t in trials if t.listed],
        INCLUSION: [list(t.inclusions) for t in trials],
    }
    return {name: [answers for answers in groups if answers] for name, groups in found.items()}


def reliability(
    groups: Sequence[Sequence[Answer]], settings: BlindSettings = DEFAULTS
) -> list[ReliabilityBin]:
    """Bins of equal width that hold an answer; groups: answers of each trial."""
    probability, right = _arrays(groups)
    return [
        ReliabilityBin(
            mean_probability=float(np.mean(probability[inside])),
            right=Proportion.count(right[inside].tolist()),
        )
        for inside in equal_width_bins(probability, settings.calibration_bins)
    ]


def calibration_errors(
    groups: Sequence[Sequence[Answer]], settings: BlindSettings = DEFAULTS
) -> dict[str, CalibrationError]:
    """Calibration error by binning; {} without answers.

    groups: answers of each trial. The bootstrap draws whole trials, since answers about one trial hang
    together.
    """
    if not groups:
        return {}
    rng = np.random.default_rng(settings.bootstrap_seed)
    draws = rng.integers(len(groups), size=(settings.bootstrap_draws, len(groups)))
    arrays = [_arrays([group]) for group in groups]
    drawn = [_joined(arrays, draw) for draw in draws]
    whole, count = _arrays(groups), settings.calibration_bins
    found = {}
    for name, bins in BINNINGS.items():
        errors = [expected_calibration_error(p, r, bins(p, count)) for p, r in drawn]
        low, high = np.percentile(errors, [2.5, 97.5])
        value = expected_calibration_error(*whole, bins(whole[0], count))
        found[name] = CalibrationError(value=value, low=float(low), high=float(high))
    return found


def expected_calibration_error(probability: NDArray, right: NDArray, bins: Sequence[NDArray]) -> float:
    """Expected calibration error [-].

    Args:
        probability: of each answer [-], (answers,).
        right: whether it came true, (answers,).
        bins: indices of the answers in each bin, (answers in the bin,) each.
    """
    off = [abs(np.sum(probability[inside]) - np.sum(right[inside])) for inside in bins]
    return float(sum(off) / len(probability))


def equal_width_bins(probability: NDArray, count: int) -> list[NDArray]:
    """Indices (answers in the bin,) of each bin that is not empty; probability: (answers,) [-]."""
    number = np.minimum((probability * count).astype(int), count - 1)
    return [np.flatnonzero(number == k) for k in np.unique(number)]


def equal_mass_bins(probability: NDArray, count: int) -> list[NDArray]:
    """Indices (answers in the bin,) of each bin that is not empty; probability: (answers,) [-]."""
    parts = np.array_split(np.argsort(probability, kind="stable"), count)
    return [part for part in parts if len(part)]


BINNINGS: Mapping[str, Callable[[NDArray, int], list[NDArray]]] = {
    EQUAL_WIDTH: equal_width_bins,
    EQUAL_MASS: equal_mass_bins,
}
"""How answers are binned, by name."""


def _arrays(groups: Sequence[Sequence[Answer]]) -> tuple[NDArray, NDArray]:
    """Probabilities and truths of all answers, (answers,) each."""
    answers = [answer for group in groups for answer in group]
    return (
        np.array([answer.probability for answer in answers], dtype=float),
        np.array([answer.right for answer in answers], dtype=bool),
    )


def _joined(arrays: Sequence[tuple[NDArray, NDArray]], draw: NDArray) -> tuple[NDArray, NDArray]:
    """Answers of the drawn trials, (answers,) each; draw: indices of trials, (trials,)."""
    drawn = [arrays[index] for index in draw]
    return np.concatenate([p for p, _ in drawn]), np.concatenate([r for _, r in drawn])
