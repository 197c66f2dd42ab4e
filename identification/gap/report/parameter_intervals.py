"""Fitted parameters of a diagnosis with their intervals."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from identification.gap.diagnosis import Diagnosis
from identification.gap.rank.evidence import EvaluatedHypothesis
from identification.gap.rank.posterior import variance_inflation


def fitted_values(diagnosis: Diagnosis, hypothesis: EvaluatedHypothesis) -> dict[str, float]:
    """Calibrated parameters, parameters of causes and the unit's tolerances by symbol [SI].

    A cause's parameter that is also a tolerance includes its own scatter.
    """
    problem = diagnosis.ranking.problem
    values = problem.values(hypothesis.estimate)
    pairs = zip(problem.plant.tolerances, hypothesis.tolerances, strict=True)
    for tolerance, deviation in pairs:
        own = values.get(tolerance.symbol, tolerance.centre)
        values[tolerance.symbol] = float(own + deviation * tolerance.sd)
    return values


def parameter_intervals(
    diagnosis: Diagnosis, hypothesis: EvaluatedHypothesis
) -> list[tuple[float, float, float]]:
    """Value and ends of the interval of each parameter of the hypothesis' causes [SI].

    No interval leaves the parameter's physical range.
    """
    quantile = norm.ppf(0.5 + diagnosis.settings.reduction.interval_level / 2)
    estimate = hypothesis.estimate
    covariance = parameter_covariance(diagnosis, hypothesis)
    deviations = np.sqrt(np.diag(covariance))[estimate.cause_start :]
    intervals = []
    for p, scaled, sd in zip(
        estimate.hypothesis.parameters, estimate.cause_vector, deviations, strict=True
    ):
        value, margin = float(scaled * p.scale), float(quantile * sd)
        low, high = sorted((p.low, p.high))
        intervals.append((value, max(value - margin, low), min(value + margin, high)))
    return intervals


def parameter_covariance(diagnosis: Diagnosis, hypothesis: EvaluatedHypothesis) -> NDArray:
    """Covariance of calibrated parameters and parameters of causes, (k, k) [SI].

    Noise and discrepancy of the readings, as large and as correlated as they are, and errors of form
    that no recording shows.
    """
    systematic_form_error = diagnosis.settings.report.systematic_form_error
    inflation = variance_inflation(hypothesis, diagnosis.ranking.discrepancies)
    estimate = hypothesis.estimate
    deviations = np.zeros(len(estimate.vector))
    exact = [cause.exact_form for cause in estimate.hypothesis.causes for _ in cause.parameters]
    pairs = zip(estimate.hypothesis.parameters, exact, strict=True)
    for i, (p, known) in enumerate(pairs, start=estimate.cause_start):
        acting = estimate.vector[i] * p.scale - p.nominal
        deviations[i] = 0.0 if known else systematic_form_error * acting
    return inflation * hypothesis.covariance + np.diag(deviations**2)
