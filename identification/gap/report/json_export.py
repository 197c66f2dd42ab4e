"""The diagnosis as JSON: format epv-gap/2, described in docs/reference/gap-json.md."""

import re
from typing import Any

import numpy as np

from identification.gap.diagnosis import Diagnosis, hypothesis_label
from identification.gap.rank.verdict import RankedCause
from identification.gap.reduce.discrepancy_reduction import NOMINAL, RECALIBRATED
from identification.gap.reduce.gaps import FLOOR
from identification.gap.report.parameter_intervals import fitted_values, parameter_intervals
from identification.gap.report.remainder import remainder


def as_json(diagnosis: Diagnosis, next_experiment: str = "", term: str | None = None) -> dict[str, Any]:
    """The content of gap.json.

    Args:
        diagnosis: what to write.
        next_experiment: a sentence, empty where none was sought.
        term: name of the file beside gap.json that holds the missing term; None where none was written.
    """
    conclusion = diagnosis.conclusion
    causes = conclusion.causes[: diagnosis.settings.report.listed_causes]
    separability = diagnosis.ranking.separability
    return {
        "format": "epv-gap/2",
        "verdict": conclusion.verdict,
        "where": _where(diagnosis),
        "causes": [_cause(diagnosis, cause) for cause in causes],
        "ambiguity_set": [list(cause.effects) for cause in conclusion.ambiguity_set],
        "gap": _gap(diagnosis),
        "unexplained": _unexplained(diagnosis),
        "inclusion": inclusion(diagnosis),
        "remainder": _remainder(diagnosis, term),
        "discrepancy": discrepancy(diagnosis),
        "parameters": _parameters(diagnosis),
        "next_experiment": next_experiment,
        "probability": {
            "no_cause": diagnosis.ranking.no_cause,
            "unknown": diagnosis.ranking.unknown,
        },
        "twins": {
            label: list(twins)
            for cause in diagnosis.judged
            for label in cause.hypothesis.labels
            if (twins := separability.twins(label))
        },
        "absorbed": list(separability.absorbed),
        "warnings": diagnosis.warnings,
    }


def inclusion(diagnosis: Diagnosis) -> dict[str, float]:
    """Probability that each effect is part of the gap, of effects with a noticeable one."""
    least = diagnosis.settings.report.listed_inclusion
    found = diagnosis.ranking.inclusion.items()
    return {name: min(float(probability), 1.0) for name, probability in found if probability >= least}


def discrepancy(diagnosis: Diagnosis) -> dict[str, dict[str, float]]:
    """By channel: what model and recordings differ by beyond noise, and how long it is correlated.

    Its standard deviation [unit of the channel] and its time scale [s]; 0 where nothing is seen.
    """
    ranking = diagnosis.ranking
    channels = zip(ranking.problem.plant.channels, ranking.discrepancies, strict=True)
    return {
        channel.name: {
            "sd": float(seen.sd * (channel.noise or 0.0) / channel.scale),
            "time_scale_s": float(seen.time_scale),
        }
        for channel, seen in channels
    }


def magnitudes(diagnosis: Diagnosis, cause: RankedCause) -> dict[str, tuple[float, float, float]]:
    """Value and ends of the interval of each parameter of a cause, by symbol_unit [SI]."""
    parameters = cause.hypothesis.estimate.hypothesis.parameters
    intervals = parameter_intervals(diagnosis, cause.hypothesis)
    return {
        f"{p.symbol}_{unit_name(p.unit)}": interval
        for p, interval in zip(parameters, intervals, strict=True)
    }


def unit_name(unit: str) -> str:
    """A unit as part of a name: K/J becomes K_per_J, m^2 becomes m2, none 1."""
    named = unit.replace("^", "").replace("/", "_per_").replace("-", "1")
    return re.sub(r"[^A-Za-z0-9]+", "_", named).strip("_") or "1"


def remaining_location(diagnosis: Diagnosis) -> str | None:
    """Component and equation of what the best cause leaves; None where nothing is left."""
    if diagnosis.remaining is None or not diagnosis.remaining.forcings:
        return None
    equation = diagnosis.remaining.likeliest.equation
    return f"{equation.component}: {equation.name}"


def _unexplained(diagnosis: Diagnosis) -> dict[str, Any]:
    unexplained = diagnosis.reduction.unexplained
    return {
        "fraction": unexplained.fraction,
        "still_predictable": unexplained.still_predictable,
        "p_value": unexplained.p_value,
        "location": remaining_location(diagnosis),
    }


def _remainder(diagnosis: Diagnosis, term: str | None) -> dict[str, Any]:
    found = remainder(diagnosis)
    return {
        "fraction": found.share.value,
        "low": found.share.low,
        "high": found.share.high,
        "component": dict(found.component),
        "equation": dict(found.equation),
        "term": term,
    }


def _where(diagnosis: Diagnosis) -> dict[str, Any]:
    localisation = diagnosis.localisation
    return {
        "component": diagnosis.conclusion.component_probabilities,
        "equation": dict(localisation.equation_probabilities),
        "channel": dict(localisation.channel_gaps),
        "regimes": [
            {
                "channel": gap.channel,
                "regime": gap.regime,
                "gap": gap.gap,
                "low": gap.low,
                "high": gap.high if np.isfinite(gap.high) else None,
            }
            for gap in localisation.regime_gaps
        ],
    }


def _cause(diagnosis: Diagnosis, cause: RankedCause) -> dict[str, Any]:
    entry: dict[str, Any] = {
        "effects": list(cause.effects),
        "probability": cause.probability,
        "magnitude": {name: list(values) for name, values in magnitudes(diagnosis, cause).items()},
        "converged": cause.hypothesis.converged,
    }
    label = hypothesis_label(cause.hypothesis)
    if label in diagnosis.reduction.shares_closed:
        share = diagnosis.reduction.shares_closed[label]
        entry["shrink"] = {"fraction": share.value, "low": share.low, "high": share.high}
        entry["gap"] = diagnosis.reduction.gaps[label].overall.value
    return entry


def _gap(diagnosis: Diagnosis) -> dict[str, Any]:
    gaps, best = diagnosis.reduction.gaps, _best_label(diagnosis)
    labels = {"nominal": NOMINAL, "recalibrated": RECALIBRATED, "with_cause": best}
    overall = {name: gaps[label].overall for name, label in labels.items()}
    overall["black_box_floor"] = diagnosis.reduction.black_box.overall
    return {
        "floor": FLOOR,
        **{name: interval.value for name, interval in overall.items()},
        "interval": {name: [i.low, i.high] for name, i in overall.items()},
        "channel": {
            name: {channel: i.value for channel, i in gaps[label].channels.items()}
            for name, label in labels.items()
        },
        "report_metric_percent": {
            name: (gaps[label].percent or {}).get("overall") for name, label in labels.items()
        },
    }


def _parameters(diagnosis: Diagnosis) -> dict[str, Any]:
    recalibrated, best = diagnosis.ranking.recalibrated, diagnosis.best
    return {
        "nominal": diagnosis.ranking.problem.values(diagnosis.nominal),
        "recalibrated": fitted_values(diagnosis, recalibrated),
        "with_cause": fitted_values(diagnosis, best.hypothesis if best else recalibrated),
    }


def _best_label(diagnosis: Diagnosis) -> str:
    """Label of the model that the verdict leaves in force."""
    return hypothesis_label(diagnosis.best.hypothesis) if diagnosis.best else RECALIBRATED
