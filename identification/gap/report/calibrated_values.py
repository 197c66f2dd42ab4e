"""The calibrated parameters on the first screen: what they mean, and whether to trust them."""

import numpy as np
from scipy.stats import norm

from identification.gap.diagnosis import Diagnosis, hypothesis_title
from identification.gap.model.free_parameter import FreeParameter
from identification.gap.report.parameter_intervals import parameter_covariance
from identification.gap.report.quantities import quantity, quantity_with_interval
from identification.report.page import ANSWERS, Table


def calibrated_values(diagnosis: Diagnosis, status: str) -> Table:
    """Calibrated parameters of the model to use, with intervals; status: of the verdict."""
    problem, kept = diagnosis.ranking.problem, diagnosis.kept
    fitted = problem.values(kept.estimate)
    level = diagnosis.settings.reduction.interval_level
    quantile = float(norm.ppf(0.5 + level / 2))
    margins = quantile * np.sqrt(np.diag(parameter_covariance(diagnosis, kept)))
    rows, statuses = [], []
    for parameter, margin in zip(problem.plant.parameters, margins, strict=False):
        value = fitted[parameter.symbol]
        low, high = sorted((parameter.low, parameter.high))
        ends = max(value - margin, low), min(value + margin, high)
        own = "bad" if _at_an_end(diagnosis, parameter, value) else status
        why = ": at an end of its range" if own != status else ""
        rows.append(
            [
                parameter.title,
                quantity(parameter.nominal, parameter.unit),
                quantity_with_interval(value, *ends, parameter.unit),
                ANSWERS[own] + why,
            ]
        )
        statuses.append(own)
    model = f"with {hypothesis_title(kept)}" if kept.labels else "recalibrated, without a cause"
    return Table(
        columns=["Parameter", "nominal", f"fitted ({100 * level:g} % interval)", "trust it"],
        rows=rows,
        statuses=statuses,
        caption=f"Calibrated parameters of the model to use: {model}.",
    )


def _at_an_end(diagnosis: Diagnosis, parameter: FreeParameter, value: float) -> bool:
    """Whether a fitted value [SI] lies at an end of its physical range."""
    apart = min(abs(value - parameter.low), abs(value - parameter.high))
    tolerance = diagnosis.settings.report.bound_tolerance
    return apart <= tolerance * abs(parameter.high - parameter.low)
