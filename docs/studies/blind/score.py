"""One diagnosis scored against its label (gap.json against sealed.json), and all trials together.

A statement of probability p should come true in a share p of the cases. The expected calibration error
is the mean over all answers of the distance between the stated probability and the share that came
true, both averaged over bins of equal width (Naeini et al. 2015, Guo et al. 2017). Chance alone lifts
the error of a perfectly calibrated judge above 0, the more the fewer answers a bin has.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

from docs.studies.blind.truth import (
    ABSORBED,
    EXCLUDED_EFFECT,
    NOMINAL,
    ONE_CAUSE,
    PARAMETER,
    TWO_EFFECTS,
)
from epv_env.plant.effects.registry import effect
from identification.valve_gap.causes import PARAMETER_COMPONENTS

NAMING_VERDICTS = ("known", "ambiguous", "partial")
"""Verdicts that name a cause."""

BINS = 10
"""Of the calibration error [-]: with 300 answers the fullest ones still have narrow intervals."""

FIRST = "first cause"
"""Statement whose probability is compared with what was true, where the verdict names a cause. Without
a right cause (no effect, effect struck) every answer is wrong."""


def score_trial(label: Mapping[str, Any], diagnosis: Mapping[str, Any] | None) -> dict[str, Any]:
    """The score of one trial, JSON-ready.

    label: content of sealed.json. diagnosis: content of gap.json; None where it failed.
    """
    said = diagnosis or {"verdict": "failed"}
    causes, named = said.get("causes", []), named_cause(said)
    set_ = said.get("ambiguity_set", [])
    components = said.get("where", {}).get("component", {})
    listed = causes[:1] if said["verdict"] in NAMING_VERDICTS else []
    component = max(components, key=components.get) if any(components.values()) else ""
    score = {
        "number": label["trial"],
        "kind": label["kind"] if label["kind"] == NOMINAL or label["visible"] else ABSORBED,
        "causes": label["effects"],
        "explainable": label["gap"]["explainable"],
        "verdict": said["verdict"],
        "named": list(named),
        "named_right": is_correct(label, named),
        "tied": is_tied(label, said),
        "truth_in_set": any(is_correct(label, effects) for effects in set_),
        "set_size": len(set_),
        "probability": sum(c["probability"] for c in causes if is_correct(label, c["effects"])),
        "false_name": bool(set(named) - set(label["effects"])),
        "component": component,
        "component_right": component in {component_of(cause) for cause in label["visible"]},
        FIRST: [[c["probability"], is_true(label, c["effects"])] for c in listed],
        "seconds": said.get("seconds"),
    }
    return score | {"well_judged": is_well_judged(score)}


def named_cause(diagnosis: Mapping[str, Any]) -> tuple[str, ...]:
    """Effects of the first cause where the verdict names it; else ()."""
    causes = diagnosis.get("causes", [])
    return tuple(causes[0]["effects"]) if diagnosis["verdict"] in NAMING_VERDICTS and causes else ()


def is_tied(label: Mapping[str, Any], diagnosis: Mapping[str, Any]) -> bool:
    """Whether a named first cause is as probable as a wrong one after it: its place is chance."""
    causes = diagnosis.get("causes", [])
    if not named_cause(diagnosis) or len(causes) < 2:
        return False
    least = causes[0]["probability"] - 1e-3  # no one acts on less
    rivals = [cause for cause in causes[1:] if cause["probability"] >= least]
    return any(not is_correct(label, cause["effects"]) for cause in rivals)


def is_correct(label: Mapping[str, Any], effects: Sequence[str]) -> bool:
    """Whether a cause names all visible causes of the truth, and nothing that is untrue.

    A cause may name or omit an effect of a pair that recalibration absorbs. The order does not matter.
    """
    return bool(label["visible"]) and is_true(label, effects)


def is_true(label: Mapping[str, Any], effects: Sequence[str]) -> bool:
    """As `is_correct`; where recalibration absorbs everything, any part of the truth will do."""
    visible, true = set(label["visible"]), set(label["effects"])
    return bool(effects) and visible <= set(effects) <= true


def component_of(cause: str) -> str:
    """Component in which a cause lies."""
    if cause.startswith(PARAMETER):
        return PARAMETER_COMPONENTS[cause.removeprefix(PARAMETER)]
    return effect(cause).component


def is_well_judged(trial: Mapping[str, Any]) -> bool:
    """Whether the verdict is correct, and the first cause where there is one to name.

    Where the effect is struck, any word is correct but `known` and `no_gap`.
    """
    if trial["kind"] in (NOMINAL, ABSORBED):
        return trial["verdict"] == "no_gap"
    if trial["kind"] == EXCLUDED_EFFECT:
        return trial["verdict"] in ("unknown", "ambiguous", "partial")
    return trial["named_right"]


def share(properties: Iterable[bool]) -> dict[str, Any]:
    """How many of how many cases are true: value, exact 95 % interval, counts.

    The interval is Clopper and Pearson's (1934). Without cases the value is None.
    """
    cases = [bool(case) for case in properties]
    if not cases:
        return {"value": None, "low": 0.0, "high": 1.0, "hits": 0, "of": 0}
    hits = sum(cases)
    low, high = map(float, binomtest(hits, len(cases)).proportion_ci())
    return {"value": hits / len(cases), "low": low, "high": high, "hits": hits, "of": len(cases)}


def figures(trials: Sequence[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Shares, means and the calibration error by the name that the page shows, JSON-ready.

    Detection and cause are judged where there is something to explain.
    """

    def of_kind(*kinds: str) -> list[dict[str, Any]]:
        return [t for t in trials if t["kind"] in kinds]

    def alarms(chosen: Sequence[dict[str, Any]]) -> dict[str, Any]:
        return share(t["verdict"] in (*NAMING_VERDICTS, "unknown") for t in chosen)

    def first_right(chosen: Sequence[dict[str, Any]]) -> dict[str, Any]:
        return share(t["named_right"] and not t["tied"] for t in chosen)

    def mean(values: Sequence[float]) -> dict[str, Any]:
        return {"value": float(np.mean(values)) if values else None}

    one, two, struck = of_kind(ONE_CAUSE), of_kind(TWO_EFFECTS), of_kind(EXCLUDED_EFFECT)
    caused = [*one, *two]
    return {
        "False alarms without an effect": alarms(of_kind(NOMINAL)),
        "No gap where recalibration absorbs the cause": share(
            t["well_judged"] for t in of_kind(ABSORBED)
        ),
        "Gap detected": alarms([*caused, *struck]),
        "Truth in the ambiguity set": share(t["truth_in_set"] for t in caused),
        "First cause right (a tie counts as wrong)": first_right(caused),
        "First cause right, one cause": first_right(one),
        "First cause right, two causes": first_right(two),
        "Component right": share(t["component_right"] for t in caused),
        "Effect struck from the catalogue: not `known`": share(t["well_judged"] for t in struck),
        "False effect named": share(t["false_name"] for t in trials),
        "Diagnosis failed": share(t["verdict"] == "failed" for t in trials),
        "Mean probability on the truth": mean([t["probability"] for t in caused]),
        "Calibration error of the first cause": calibration_error(*answers(trials)),
        "Mean size of the ambiguity set": mean([t["set_size"] for t in caused if t["set_size"]]),
        "Seconds per diagnosis": mean([t["seconds"] for t in trials if t["seconds"] is not None]),
    }


def answers(trials: Sequence[Mapping[str, Any]]) -> tuple[NDArray, NDArray]:
    """Stated probability of each first cause, and whether it is true, (answers,) each."""
    given = np.array([answer for trial in trials for answer in trial[FIRST]], float).reshape(-1, 2)
    return given[:, 0], given[:, 1]


def expected_calibration_error(probability: NDArray, right: NDArray) -> float:
    """Expected calibration error [-]; probability and truth of each answer, (answers,) each."""
    off = np.bincount(_bin(probability), weights=probability - right, minlength=BINS)
    return float(np.sum(np.abs(off)) / len(probability))


def calibration_error(probability: NDArray, right: NDArray) -> dict[str, Any]:
    """Expected calibration error of answers (n,) [-], with the 95 % interval of the bootstrap.

    The answers are one of each trial. Without answers the value is None.
    """
    n = len(probability)
    if not n:
        return {"value": None}
    draws = np.random.default_rng(0).integers(n, size=(2000, n))
    errors = [expected_calibration_error(probability[draw], right[draw]) for draw in draws]
    low, high = np.percentile(errors, [2.5, 97.5])
    value = expected_calibration_error(probability, right)
    return {"value": value, "low": float(low), "high": float(high)}


def _bin(probability: NDArray) -> NDArray:
    """Number of each answer's bin (answers,)."""
    return np.minimum((probability * BINS).astype(int), BINS - 1)
