"""Calibration of a blind check, for the report and as numbers."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from identification.report.page import Picture, Table
from identification.studies.blind.calibration import (
    BINNINGS,
    EQUAL_WIDTH,
    FIRST,
    answers_by_trial,
    calibration_errors,
    reliability,
)
from identification.studies.blind.calibration_figure import reliability_figure
from identification.studies.blind.score import Answer, TrialScore
from identification.studies.blind.settings import DEFAULTS, BlindSettings

FIGURE_CAPTION = (
    "Reliability: where the verdict names a cause, the first one's probability against the share that "
    "is right; and the probability of every effect to be part of the truth. Numbers: answers in a bin; "
    "error bars: exact 95 % intervals."
)
TABLE_CAPTION = (
    "Expected calibration error with its 95 % bootstrap interval over trials. The criterion is that of "
    f"the {FIRST}, {EQUAL_WIDTH}. Overconfidence: mean probability less the share that is right."
)


def calibration_blocks(
    trials: Sequence[TrialScore], settings: BlindSettings = DEFAULTS
) -> tuple[Picture, Table]:
    """The reliability diagram and the table of calibration errors."""
    rows = []
    for name, found in calibration_json(trials, settings).items():
        errors = [_error_cell(found["ece"].get(binning)) for binning in BINNINGS]
        over = "-" if found["overconfidence"] is None else f"{found['overconfidence']:+.3f}"
        rows.append([name, str(found["answers"]), *errors, over])
    columns = ["Statement", "answers", *(f"error, {name}" for name in BINNINGS), "overconfidence"]
    return (
        Picture(figure=reliability_figure(trials, settings), caption=FIGURE_CAPTION),
        Table(columns=columns, rows=rows, caption=TABLE_CAPTION),
    )


def calibration_json(trials: Sequence[TrialScore], settings: BlindSettings = DEFAULTS) -> dict[str, Any]:
    """Calibration errors and the bins of the reliability diagram by statement, JSON-ready."""
    return {
        name: {
            "answers": sum(len(group) for group in groups),
            "overconfidence": _overconfidence(groups),
            "ece": {
                binning: vars(error) for binning, error in calibration_errors(groups, settings).items()
            },
            "bins": [
                {"probability": bin_.mean_probability, "right": bin_.right.as_json()}
                for bin_ in reliability(groups, settings)
            ],
        }
        for name, groups in answers_by_trial(trials).items()
    }


def _overconfidence(groups: Sequence[Sequence[Answer]]) -> float | None:
    """Mean probability less the share that is right [-]; None without answers."""
    answers = [answer for group in groups for answer in group]
    return float(np.mean([a.probability - a.right for a in answers])) if answers else None


def _error_cell(error: dict[str, float] | None) -> str:
    return "-" if not error else f"{error['value']:.3f} ({error['low']:.3f} to {error['high']:.3f})"
