"""Validation on held-out recordings: the report's errors, and whether the residuals are white."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.parameters import Parameters
from identification.calibration.problem import CalibrationProblem
from identification.quality.correlation_tests import WhitenessTest, assess_whiteness
from identification.recordings.recording import OUTPUTS, CampaignError
from identification.replay.responses import Response, responses

LONGEST_LAG = 0.05
"""Up to where residuals are correlated with themselves [s]."""


@dataclass(frozen=True, kw_only=True)
class OutputResidual:
    """What the model leaves of one output of one recording, in noise deviations."""

    recording: str
    output: str
    rms: float
    """1.0 is the floor: nothing left to explain."""
    whiteness: WhitenessTest


@dataclass(frozen=True, kw_only=True)
class Validation:
    """The calibrated model against held-out recordings."""

    parameters: Parameters
    answers: Sequence[Response]
    residuals: Sequence[OutputResidual]

    @property
    def worst(self) -> float:
        """Greatest partial error (eq. 20), a fraction."""
        return max(answer.partial for answer in self.answers)


def validate(problem: CalibrationProblem, parameters: Parameters) -> Validation:
    """Simulate the held-out recordings; nothing is fitted to them.

    Raises CampaignError if there is none.
    """
    if not problem.validation:
        raise CampaignError(
            "the campaign has no recording with role 'validation': hold one out from the calibration"
        )
    answers = responses(problem.validation, parameters)
    return Validation(
        parameters=parameters,
        answers=answers,
        residuals=[r for answer in answers for r in _residuals(answer, problem)],
    )


def _residuals(answer: Response, problem: CalibrationProblem) -> list[OutputResidual]:
    lags = min(round(LONGEST_LAG / answer.recording.period), len(answer.recording) // 5)
    found = []
    for output, measured, model in zip(OUTPUTS, answer.measured, answer.model, strict=True):
        scaled: NDArray = (measured - model) / problem.noise[output]
        found.append(
            OutputResidual(
                recording=answer.recording.name,
                output=output,
                rms=float(np.sqrt(np.mean(scaled**2))),
                whiteness=assess_whiteness(scaled, lags),
            )
        )
    return found
