"""The diagnosis as JSON: format epv-gap/1, described in docs/gap.md."""

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from identification.gap.diagnosis import Diagnosis, label
from identification.gap.rank.evidence import Assessed
from identification.gap.rank.verdict import Ranked
from identification.gap.reduce.block_bootstrap import LEVEL
from identification.gap.reduce.discrepancy_reduction import NOMINAL, RECALIBRATED
from identification.gap.reduce.gaps import FLOOR

LISTED = 10
"""Causes in the file."""

SYSTEMATIC = 0.07
"""Relative standard deviation of a size by the form's error that the recordings cannot show: what errs
everywhere alike looks like another size."""


def as_json(diagnosis: Diagnosis, next_experiment: str = "") -> dict[str, Any]:
    """JSON-ready; figures as in docs/gap.md."""
    conclusion, shrinkage = diagnosis.conclusion, diagnosis.shrinkage
    return {
        "format": "epv-gap/1",
        "verdict": conclusion.verdict,
        "where": _where(diagnosis),
        "causes": [_cause(diagnosis, cause) for cause in conclusion.causes[:LISTED]],
        "ambiguity_set": [list(cause.effects) for cause in conclusion.ambiguity],
        "gap": _gap(diagnosis),
        "unexplained": {
            "fraction": shrinkage.unexplained.fraction,
            "still_predictable": shrinkage.unexplained.still_predictable,
            "p_value": shrinkage.unexplained.p_value,
            "location": location(diagnosis),
        },
        "parameters": _parameters(diagnosis),
        "next_experiment": next_experiment,
        "probability": {
            "no_cause": diagnosis.verdicts.no_cause,
            "unknown": diagnosis.verdicts.unknown,
        },
        "twins": {
            name: list(twins)
            for cause in diagnosis.judged
            for name in cause.found.name
            if (twins := diagnosis.verdicts.separability.twins(name))
        },
        "absorbed": list(diagnosis.verdicts.separability.absorbed),
        "warnings": diagnosis.warnings,
    }


def values(diagnosis: Diagnosis, found: Assessed) -> dict[str, float]:
    """Calibrated parameters, sizes, and where a unit's other parameters lie within their scatter [SI].

    A size that is a parameter of the unit's itself includes what its own scatter has of it.
    """
    fitter = diagnosis.verdicts.fitter
    result = fitter.values(found.point)
    for tolerance, share in zip(fitter.plant.tolerances, found.tolerances, strict=True):
        own = result.get(tolerance.symbol, tolerance.centre)
        result[tolerance.symbol] = float(own + share * tolerance.sd)
    return result


def magnitudes(found: Assessed) -> dict[str, tuple[float, float, float]]:
    """Value and ends of the 90 % interval of each size, by symbol_unit [SI]."""
    quantile = norm.ppf(0.5 + LEVEL / 2)
    sizes = found.point.hypothesis.sizes
    vector = found.point.vector[found.point.first_size :]
    deviations = np.sqrt(np.diag(covariance(found)))[found.point.first_size :]
    result = {}
    for size, scaled, sd in zip(sizes, vector, deviations, strict=True):
        value, margin = float(scaled * size.scale), float(quantile * sd)
        low, high = sorted((size.low, size.high))
        result[f"{size.symbol}_{unit_name(size.unit)}"] = (
            value,
            max(value - margin, low),
            min(value + margin, high),
        )
    return result


def covariance(found: Assessed) -> NDArray:
    """Of calibrated parameters and sizes (k, k) [SI], with errors of form that no recording shows."""
    exact = [cause.exact for cause in found.point.hypothesis.causes for _ in cause.sizes]
    sizes = found.point.hypothesis.sizes
    form = np.zeros(len(found.point.vector))
    for i, (size, known) in enumerate(zip(sizes, exact, strict=True), start=found.point.first_size):
        form[i] = 0.0 if known else SYSTEMATIC * (found.point.vector[i] * size.scale - size.off)
    return found.covariance + np.diag(form**2)


def unit_name(unit: str) -> str:
    """A unit as part of a name: K/J becomes K_per_J, m^2 becomes m2, none 1."""
    named = unit.replace("^", "").replace("/", "_per_").replace("-", "1")
    return re.sub(r"[^A-Za-z0-9]+", "_", named).strip("_") or "1"


def location(diagnosis: Diagnosis) -> str | None:
    """The component and equation of what the best cause leaves; None where nothing is left."""
    if diagnosis.left is None or not diagnosis.left.forcings:
        return None
    weights = diagnosis.left.equation
    likeliest = max(diagnosis.left.forcings, key=lambda forcing: weights[forcing.equation.name])
    return f"{likeliest.equation.component}: {likeliest.equation.name}"


def _where(diagnosis: Diagnosis) -> dict[str, Any]:
    where = diagnosis.where
    return {
        "component": diagnosis.conclusion.component,
        "equation": dict(where.equation),
        "channel": dict(where.channel),
        "regimes": [
            {
                "channel": gap.channel,
                "regime": gap.regime,
                "gap": gap.gap,
                "low": gap.low,
                "high": gap.high if np.isfinite(gap.high) else None,
            }
            for gap in where.regimes
        ],
    }


def _cause(diagnosis: Diagnosis, cause: Ranked) -> dict[str, Any]:
    entry: dict[str, Any] = {
        "effects": list(cause.effects),
        "probability": cause.probability,
        "magnitude": {name: list(values) for name, values in magnitudes(cause.found).items()},
        "converged": cause.found.converged,
    }
    name = label(cause.found)
    if name in diagnosis.shrinkage.shrink:
        shrink = diagnosis.shrinkage.shrink[name]
        entry["shrink"] = {"fraction": shrink.value, "low": shrink.low, "high": shrink.high}
        entry["gap"] = diagnosis.shrinkage.gaps[name].overall.value
    return entry


def _gap(diagnosis: Diagnosis) -> dict[str, Any]:
    gaps, best = diagnosis.shrinkage.gaps, _best(diagnosis)
    labels = {"nominal": NOMINAL, "recalibrated": RECALIBRATED, "with_cause": best}
    overall = {name: gaps[key].overall for name, key in labels.items()}
    overall["black_box_floor"] = diagnosis.shrinkage.black_box_floor.overall
    return {
        "floor": FLOOR,
        **{name: interval.value for name, interval in overall.items()},
        "interval": {name: [i.low, i.high] for name, i in overall.items()},
        "channel": {
            name: {channel: i.value for channel, i in gaps[key].channels.items()}
            for name, key in labels.items()
        },
        "report_metric_percent": {
            name: (gaps[key].percent or {}).get("overall") for name, key in labels.items()
        },
    }


def _parameters(diagnosis: Diagnosis) -> dict[str, Any]:
    none, best = diagnosis.verdicts.none, diagnosis.best
    return {
        "nominal": diagnosis.verdicts.fitter.values(diagnosis.nominal),
        "recalibrated": values(diagnosis, none),
        "with_cause": values(diagnosis, best.found if best else none),
    }


def _best(diagnosis: Diagnosis) -> str:
    """Label of the model that the verdict leaves in force."""
    return label(diagnosis.best.found) if diagnosis.best else RECALIBRATED
