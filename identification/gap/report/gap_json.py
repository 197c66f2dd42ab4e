"""The files of a diagnosis for programs: gap.json and, where one was found, the missing term.

Format epv-gap/4, described in docs/reference/gap-json.md.
"""

import re
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from epv_env.common.files import write_json
from identification.block_bootstrap import LEVEL, Interval
from identification.gap.diagnosis import Diagnosis
from identification.gap.fit.evidence import EvaluatedHypothesis, variance_inflation
from identification.gap.fit.gaps import FLOOR
from identification.gap.fit.laws import COMPONENTS, Law, in_words
from identification.gap.judge.held_out import NOMINAL, RECALIBRATED
from identification.gap.judge.verdict import RankedCause
from identification.gap.locate.localisation import Localisation, MissingTerm

GAP, TERM = "gap.json", "missing_term.json"
FORMAT = "epv-gap/4"

LISTED_CAUSES = 10
"""Most causes in gap.json; the others are the least probable."""

LISTED_INCLUSION = 0.001
"""Probability that an effect is part of the gap from which gap.json lists it (contract)."""

DRAWN_TERM_SHARE = 0.2
"""Share of the missing term that a state must explain [1] for the term to be drawn over it."""

SYSTEMATIC_FORM_ERROR = 0.07
"""Relative standard deviation of a cause's parameter by errors of its form that the recordings cannot
show [1]: an error that is the same everywhere looks like another value of the parameter."""


TERM_FORMAT = "epv-term/1"
"""Format of the file that holds a missing term."""


def as_json(diagnosis: Diagnosis, next_experiment: str = "", term: str | None = None) -> dict[str, Any]:
    """The content of gap.json: all its fields.

    Args:
        diagnosis: what to write.
        next_experiment: a sentence, empty where none was sought.
        term: name of the file beside gap.json that holds the missing term; None where none was written.
    """
    conclusion, ranking, reduction = diagnosis.conclusion, diagnosis.ranking, diagnosis.reduction
    localisation, separability = diagnosis.localisation, ranking.separability
    left, unexplained, onset = remainder(diagnosis), reduction.unexplained, diagnosis.onset
    with_cause = diagnosis.best.hypothesis if diagnosis.best else ranking.recalibrated
    labels = {
        "nominal": NOMINAL,
        "recalibrated": RECALIBRATED,
        "with_cause": with_cause.label or RECALIBRATED,
    }
    models = {name: reduction.gaps[label] for name, label in labels.items()}
    overall = {name: gap.overall for name, gap in models.items()}
    overall["black_box_floor"] = reduction.black_box.overall
    return {
        "format": FORMAT,
        "verdict": conclusion.verdict,
        "where": {
            "component": conclusion.component_probabilities,
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
        },
        "causes": [_cause(diagnosis, cause) for cause in conclusion.causes[:LISTED_CAUSES]],
        "ambiguity_set": [list(cause.effects) for cause in conclusion.ambiguity_set],
        "gap": {
            "floor": FLOOR,
            **{name: interval.value for name, interval in overall.items()},
            "interval": {name: [interval.low, interval.high] for name, interval in overall.items()},
            "channel": {
                name: {channel: interval.value for channel, interval in gap.channels.items()}
                for name, gap in models.items()
            },
            "report_metric_percent": {
                name: (gap.percent or {}).get("overall") for name, gap in models.items()
            },
        },
        "left": {
            **_fraction(share_left(diagnosis)),
            "still_predictable": unexplained.still_predictable,
            "p_value": unexplained.p_value,
            "component": dict(
                sorted(left.component_probabilities.items(), key=lambda pair: -pair[1]) if left else ()
            ),
            "equation": dict(left.equation_probabilities if left else {}),
            "term": term,
        },
        "discrepancy": discrepancy(diagnosis),
        "parameters": {
            "nominal": fitted_values(diagnosis, diagnosis.nominal),
            "recalibrated": fitted_values(diagnosis, ranking.recalibrated),
            "with_cause": fitted_values(diagnosis, with_cause),
        },
        "screened": [asdict(finding) for finding in diagnosis.screened],
        "next_experiment": next_experiment,
        "probability": {
            "no_cause": ranking.no_cause,
            "unknown": ranking.unknown,
            "effects": _noticeable(ranking.inclusion),
        },
        "indistinguishable": {
            label: list(twins)
            for cause in diagnosis.judged
            for label in cause.hypothesis.labels
            if (twins := separability.twins(label))
        },
        "not_identifiable": list(separability.absorbed),
        "confounded_with_consumption": list(diagnosis.as_consumption),
        "onset": asdict(onset) if onset else None,
        "warnings": diagnosis.warnings,
    }


def _cause(diagnosis: Diagnosis, cause: RankedCause) -> dict[str, Any]:
    """An entry of `causes`; the last two fields only where the reduction was measured."""
    label, laws = cause.hypothesis.label, cause.hypothesis.estimate.laws
    entry: dict[str, Any] = {
        "effects": list(cause.effects),
        "probability": cause.probability,
        "magnitude": {name: list(values) for name, values in magnitudes(diagnosis, cause).items()},
        "form": form_in_words(diagnosis, cause.hypothesis),
        "laws": [
            {
                "effect": law.cause.label,
                "argument": law.argument,
                "low": law.low,
                "high": law.high,
                "growth": law.growth(components).tolist(),
            }
            for law, components in laws
        ],
        "converged": cause.hypothesis.converged,
        "onset": {label: asdict(onset) for label, onset in diagnosis.onsets_of(cause).items()},
    }
    if label in diagnosis.reduction.shares_closed:
        entry["shrink"] = _fraction(diagnosis.share_closed(cause))
        entry["gap"] = diagnosis.reduction.gaps[label].overall.value
    return entry


def _fraction(share: Interval) -> dict[str, float]:
    return {"fraction": share.value, "low": share.low, "high": share.high}


def _noticeable(probabilities: Mapping[str, float]) -> dict[str, float]:
    return {name: min(float(p), 1.0) for name, p in probabilities.items() if p >= LISTED_INCLUSION}


def discrepancy(diagnosis: Diagnosis) -> dict[str, dict[str, float]]:
    """By channel: what model and recordings differ by beyond noise, and how long it is correlated.

    Its standard deviation [unit of the channel] and its time scale [s]; 0 where nothing is seen.
    """
    ranking = diagnosis.ranking
    channels = zip(ranking.problem.plant.channels, ranking.noise, strict=True)
    return {
        channel.name: {
            "sd": float(seen.sd * (channel.noise or 0.0) / channel.scale),
            "time_scale_s": float(seen.time_scale),
        }
        for channel, seen in channels
    }


def magnitudes(diagnosis: Diagnosis, cause: RankedCause) -> dict[str, tuple[float, float, float]]:
    """Value and ends of the interval of each parameter of a cause, by symbol_unit [SI]."""
    intervals = parameter_intervals(diagnosis, cause.hypothesis)
    return {
        f"{p.symbol}_{unit_name(p.unit)}": intervals[p.symbol]
        for p in cause.hypothesis.estimate.hypothesis.cause_parameters
    }


def unit_name(unit: str) -> str:
    """A unit as part of a name: K/J becomes K_per_J, m^2 becomes m2, none 1."""
    named = unit.replace("^", "").replace("/", "_per_").replace("-", "1")
    return re.sub(r"[^A-Za-z0-9]+", "_", named).strip("_") or "1"


def write_results(
    diagnosis: Diagnosis, folder: Path, next_experiment: str = "", **further: Any
) -> dict[str, Any]:
    """Write gap.json and, where a state explains what remains, missing_term.json.

    A missing term of an earlier diagnosis in the folder is removed.

    Args:
        diagnosis: what to write.
        folder: where to; made where it is missing.
        next_experiment: a sentence, empty where none was sought.
        further: other fields of gap.json.

    Returns:
        The content of gap.json.
    """
    (folder / TERM).unlink(missing_ok=True)
    term = drawn_term(remainder(diagnosis))
    if term:
        write_json(folder / TERM, term_table(term), allow_nan=False)
    content = {**as_json(diagnosis, next_experiment, TERM if term else None), **further}
    write_json(folder / GAP, content, allow_nan=False)
    return content


def remainder(diagnosis: Diagnosis) -> Localisation | None:
    """Where lies what no named cause explains; None where nothing is left to locate."""
    if diagnosis.named:
        return diagnosis.remaining
    return diagnosis.localisation if _explainable(diagnosis) else None


def drawn_term(location: Localisation | None) -> MissingTerm | None:
    """The missing term, where one state explains enough of it to be drawn."""
    term = location.missing_term if location else None
    return term if term and term.explained >= DRAWN_TERM_SHARE else None


def term_table(term: MissingTerm) -> dict[str, Any]:
    """The content of the file that holds a missing term; lists of one number per window."""
    return {
        "format": TERM_FORMAT,
        "equation": term.equation.name,
        "component": term.equation.component,
        "state": term.state,
        "state_unit": term.state_unit,
        "unit": term.equation.unit,
        "explained": term.explained,
        "columns": {
            "state": term.x.tolist(),
            "forcing": term.y.tolist(),
            "sd": term.sd.tolist(),
            "single_window": term.scatter.tolist(),
        },
    }


def _explainable(diagnosis: Diagnosis) -> bool:
    """Whether recalibration leaves more than noise."""
    return diagnosis.reduction.gaps[RECALIBRATED].overall.low > FLOOR


def share_left(diagnosis: Diagnosis) -> Interval:
    """Share of the explainable gap that no named cause closes [1]; 0 where nothing can be explained."""
    whole = 1.0 if _explainable(diagnosis) else 0.0
    if not diagnosis.named:
        return Interval(value=whole, low=whole, high=whole)
    closed = diagnosis.share_closed(diagnosis.named)
    left = diagnosis.reduction.unexplained.fraction
    return Interval(value=left, low=min(1.0 - closed.high, left), high=max(1.0 - closed.low, left))


def fitted_values(diagnosis: Diagnosis, hypothesis: EvaluatedHypothesis) -> dict[str, float]:
    """Calibrated parameters, sizes of causes and the unit's tolerances by symbol [SI].

    A cause's parameter that is also a tolerance includes its own scatter.
    """
    problem, estimate = diagnosis.ranking.problem, hypothesis.estimate
    opened = {p.symbol for law in estimate.hypothesis.laws for p in law.parameters}
    values = {s: v for s, v in problem.values(estimate).items() if s not in opened}
    for tolerance, deviation in zip(problem.plant.tolerances, hypothesis.tolerances, strict=True):
        centre = values.get(tolerance.symbol, tolerance.centre)
        values[tolerance.symbol] = float(centre + deviation * tolerance.sd)
    return values


def parameter_intervals(
    diagnosis: Diagnosis, hypothesis: EvaluatedHypothesis
) -> dict[str, tuple[float, float, float]]:
    """Value and ends of the interval of each fitted parameter, within its range, by symbol [SI]."""
    problem, estimate = diagnosis.ranking.problem, hypothesis.estimate
    quantile = norm.ppf(0.5 + LEVEL / 2)
    margins = quantile * np.sqrt(np.diag(parameter_covariance(diagnosis, hypothesis)))
    values, intervals = problem.values(estimate), {}
    for p, margin in zip(problem.parameters(estimate), margins.tolist(), strict=True):
        value = values[p.symbol]
        low, high = sorted((p.low, p.high))
        intervals[p.symbol] = value, max(value - margin, low), min(value + margin, high)
    return intervals


def form_in_words(diagnosis: Diagnosis, hypothesis: EvaluatedHypothesis) -> str:
    """How the strengths of causes follow states otherwise than the catalogue assumes."""
    return in_words([(law, z) for law, z, _ in differing_laws(diagnosis, hypothesis)])


def differing_laws(
    diagnosis: Diagnosis, hypothesis: EvaluatedHypothesis
) -> list[tuple[Law, NDArray, NDArray]]:
    """Open laws that differ from the assumed one: at some knot the band of g does not hold 0.

    Each with its components (m,) and the standard deviation of g at the knots (knots,) [1].
    """
    problem, estimate = diagnosis.ranking.problem, hypothesis.estimate
    if not estimate.laws:
        return []
    covariance, quantile = parameter_covariance(diagnosis, hypothesis), norm.ppf(0.5 + LEVEL / 2)
    symbols = [p.symbol for p in problem.parameters(estimate)]
    found = []
    for law, components in estimate.laws:
        growth, size = law.growth(components), law.cause.sizes[0]
        places = [symbols.index(p.symbol) for p in (*law.parameters, size)]
        value = problem.values(estimate)[size.symbol] - size.nominal
        # A larger size with a smaller g is the same strength: both count together.
        slopes = np.column_stack([COMPONENTS, (1.0 + growth) / value])
        sd = np.sqrt(np.diag(slopes @ covariance[np.ix_(places, places)] @ slopes.T))
        if np.any(np.abs(growth) > quantile * sd):
            found.append((law, components, sd))
    return found


def parameter_covariance(diagnosis: Diagnosis, hypothesis: EvaluatedHypothesis) -> NDArray:
    """Covariance of calibrated parameters, components of laws and sizes of causes, (k, k) [SI].

    The residuals count as large and as correlated as they are. Beside them stand errors of form that no
    recording shows.
    """
    inflation = variance_inflation(hypothesis, diagnosis.ranking.noise)
    estimate = hypothesis.estimate
    deviations = np.zeros(len(estimate.vector))
    exact = [cause.exact_form for cause in estimate.hypothesis.causes for _ in cause.parameters]
    pairs = zip(estimate.hypothesis.cause_parameters, exact, strict=True)
    for i, (p, known) in enumerate(pairs, start=estimate.cause_start):
        acting = estimate.vector[i] * p.scale - p.nominal
        deviations[i] = 0.0 if known else SYSTEMATIC_FORM_ERROR * acting
    return inflation * hypothesis.covariance + np.diag(deviations**2)
