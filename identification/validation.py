"""Does the calibrated model hold on recordings it has not seen (section 7)?

The report's errors on the held-out recordings, whether the residuals are white noise, and both as a
section of the report (Table 15, Figure 14) and as JSON.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from epv_env.plant.parameters import Parameters
from identification.calibration.calibrate import EXPLAINED
from identification.calibration.problem import CalibrationProblem
from identification.noise import autocovariance
from identification.recordings.recording import OUTPUTS, CampaignError
from identification.replay.replay import (
    Response,
    error_table,
    errors_as_json,
    percent,
    responses,
    worst_picture,
)
from identification.report.page import Section, Table, Verdict
from identification.report_2003 import ACCEPTED_ERROR

GREATEST_LAG = 0.05
"""Greatest lag of the residuals' autocorrelation [s], at most a fifth of the recording."""

WHITE = 1e-4
"""Probability of white noise below which a residual is called predictable."""


FIRST_LAGS = 10
"""Lags of the short Ljung-Box test, which finds dependence between neighbours [samples]."""


@dataclass(frozen=True, kw_only=True)
class WhitenessTest:
    """Whether a signal's samples are independent of each other."""

    autocorrelation: NDArray
    """At lags 0, 1, ..., (lags + 1,)."""
    probability: float
    """Of white noise, by Ljung-Box tests over 10 lags and over all (the lesser one, doubled)."""

    @property
    def peak(self) -> float:
        """Greatest magnitude of the autocorrelation at a lag other than 0."""
        return float(np.max(np.abs(self.autocorrelation[1:])))


def assess_whiteness(residual: NDArray, lags: int) -> WhitenessTest:
    """Of a signal (samples,), in any unit, that changes; lags: the greatest [samples].

    Ljung and Box, On a measure of lack of fit in time series models, Biometrika 65 (1978).
    """
    n = len(residual)
    covariance = autocovariance([residual - np.mean(residual)])[: lags + 1]
    correlation = covariance / covariance[0]
    statistic = (n + 2) / n * np.cumsum(np.arange(n - 1, n - 1 - lags, -1) * correlation[1:] ** 2)
    tested = np.array([min(FIRST_LAGS, lags), lags])
    return WhitenessTest(
        autocorrelation=correlation,
        probability=float(min(1.0, 2 * np.min(chi2.sf(statistic[tested - 1], tested)))),
    )


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

    @property
    def worst(self) -> float:
        """Greatest partial error (eq. 20), a fraction."""
        return max(answer.partial for answer in self.answers)


def validate(problem: CalibrationProblem, parameters: Parameters) -> Validation:
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
        residuals=[r for answer in answers for r in _residuals(answer, problem)],
    )


def _residuals(answer: Response, problem: CalibrationProblem) -> list[OutputResidual]:
    lags = min(round(GREATEST_LAG / answer.recording.period), len(answer.recording) // 5)
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


def validation_section(validation: Validation) -> Section:
    """The 10 % rule, the residuals, the responses."""
    return Section(
        title="Validation on held-out recordings",
        verdicts=[_error_verdict(validation), _residual_verdict(validation)],
        blocks=[
            error_table(validation.answers, "Result of the model validation."),
            _residual_table(validation),
            worst_picture(validation.answers),
        ],
    )


def validation_json(validation: Validation) -> dict[str, Any]:
    """Errors in percent; residuals in noise deviations."""
    return {
        "errors_percent": errors_as_json(validation.answers),
        "residuals": [
            {
                "recording": r.recording,
                "output": r.output,
                "rms_noise_deviations": r.rms,
                "white_noise_probability": r.whiteness.probability,
                "greatest_autocorrelation": r.whiteness.peak,
            }
            for r in validation.residuals
        ],
    }


def _error_verdict(validation: Validation) -> Verdict:
    good = validation.worst < ACCEPTED_ERROR
    return Verdict(
        status="good" if good else "bad",
        text=f"The greatest partial error on held-out recordings is {percent(validation.worst)} %, "
        f"{'below' if good else 'not below'} the limit of {100 * ACCEPTED_ERROR:.0f} %.",
    )


def _residual_verdict(validation: Validation) -> Verdict:
    most = max(validation.residuals, key=lambda residual: residual.rms)
    predictable = [r for r in validation.residuals if r.whiteness.probability < WHITE]
    if most.rms <= EXPLAINED and not predictable:
        text = (
            f"The residuals are white and at most {most.rms:.3g} times the noise: "
            "nothing is left to explain."
        )
        return Verdict(status="good", text=text)
    named = ", ".join(sorted({residual.output for residual in predictable})) or most.output
    text = (
        f"The residuals reach {most.rms:.3g} times the noise ({most.output} in {most.recording}) and "
        f"are predictable in {named}: the model lacks something there."
    )
    return Verdict(status="doubt", text=text)


def _residual_table(validation: Validation) -> Table:
    columns = ["Recording", "output", "rms / noise", "greatest autocorrelation", "p of white noise"]
    return Table(
        columns=columns,
        rows=[
            [
                residual.recording,
                residual.output,
                f"{residual.rms:.3f}",
                f"{residual.whiteness.peak:.3f}",
                f"{residual.whiteness.probability:.2g}",
            ]
            for residual in validation.residuals
        ],
        caption="Residuals in noise deviations (1 is the floor), and whether they are white.",
    )
