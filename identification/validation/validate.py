"""Validation on held-out recordings: the report's errors, and whether the residuals are white."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.parameters import Parameters
from identification.calibration.problem import CalibrationProblem
from identification.quality.noise_tests import WhitenessTest, assess_whiteness
from identification.recordings.recording import OUTPUTS, CampaignError
from identification.replay.responses import Response, responses
from identification.validation.settings import VALIDATION, ValidationSettings


@dataclass(frozen=True, kw_only=True)
class OutputResidual:
    """What the model does not explain of one output of one recording."""

    recording: str
    """Name of the recording."""
    output: str
    """One of recording.OUTPUTS."""
    rms: float
    """Root mean square [noise deviations]; at 1.0 nothing is left to explain."""
    whiteness: WhitenessTest


@dataclass(frozen=True, kw_only=True)
class Validation:
    """The calibrated model against held-out recordings."""

    parameters: Parameters
    answers: Sequence[Response]
    residuals: Sequence[OutputResidual]
    settings: ValidationSettings = VALIDATION
    """What the residuals are judged by."""

    @property
    def worst(self) -> float:
        """Greatest partial error (eq. 20), a fraction."""
        return max(answer.partial for answer in self.answers)


def validate(
    problem: CalibrationProblem, parameters: Parameters, settings: ValidationSettings = VALIDATION
) -> Validation:
    """Simulate the held-out recordings; nothing is fitted to them.

    parameters: the calibrated ones [SI]. Raises CampaignError if there is none.
    """
    if not problem.validation:
        raise CampaignError(
            "the campaign has no recording with role 'validation': hold one out from the calibration"
        )
    answers = responses(problem.validation, parameters)
    return Validation(
        parameters=parameters,
        answers=answers,
        residuals=[r for answer in answers for r in _residuals(answer, problem, settings)],
        settings=settings,
    )


def _residuals(
    answer: Response, problem: CalibrationProblem, settings: ValidationSettings
) -> list[OutputResidual]:
    lags = min(round(settings.greatest_lag / answer.recording.period), len(answer.recording) // 5)
    residuals = []
    for output, measured, model in zip(OUTPUTS, answer.measured, answer.model, strict=True):
        scaled: NDArray = (measured - model) / problem.noise[output]
        residuals.append(
            OutputResidual(
                recording=answer.recording.name,
                output=output,
                rms=float(np.sqrt(np.mean(scaled**2))),
                whiteness=assess_whiteness(scaled, lags),
            )
        )
    return residuals
