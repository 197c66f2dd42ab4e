"""One diagnosis scored against its label (gap.json against sealed.json), and all trials together."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import binomtest

from epv_env.plant.effects.registry import effect
from identification.blind.truth import (
    ABSORBED,
    EXCLUDED_EFFECT,
    KIND_TITLES,
    NOMINAL,
    ONE_CAUSE,
    PARAMETER,
    TWO_EFFECTS,
)
from identification.valve_gap.causes import PARAMETER_COMPONENTS

NAMING_VERDICTS = ("known", "ambiguous", "partial")
"""Verdicts that name a cause."""

HELD_PROBABILITY = 0.9
"""Probability of being part of the truth from which an effect counts as held, and is named by the
verdict `partial` [-]: the contract's."""

TIE_MARGIN = 1e-3
"""Difference of probability up to which two causes are tied [-]: no one acts on less."""

LEAST_INCLUSION = 0.01
"""Least probability of an effect that counts as a statement about it [-]: below lie thousands of effects
that nobody would look at, whose truth would drown the rest."""


@dataclass(frozen=True, kw_only=True)
class Answer:
    """One statement with its probability, and what was true."""

    probability: float
    """As stated [-]."""
    right: bool
    """Whether the statement is true."""


@dataclass(frozen=True, kw_only=True)
class TrialScore:
    """One trial's truth, diagnosis and score."""

    number: int
    """Of the trial."""
    kind: str
    """As drawn, or ABSORBED."""
    causes: tuple[str, ...]
    """The true causes."""
    explainable: float
    """Noise-free gap that no unit of the nominal design explains [-]."""
    verdict: str
    """Of gap.json; `failed` for a diagnosis that gave none."""
    named: tuple[str, ...]
    """Effects that the verdict names (`named_cause`); () where none is named."""
    named_right: bool
    """Whether they are the truth (`is_correct`)."""
    tied: bool
    """Whether a wrong cause is as probable as the first one (`is_tied`)."""
    truth_in_set: bool
    """Whether the ambiguity set holds a correct cause."""
    set_size: int
    """Causes in the ambiguity set [-]; 0 where no cause is named."""
    probability: float
    """Sum over the correct causes [-]."""
    false_held: tuple[str, ...]
    """Effects that are held as surely present and are not part of the truth."""
    component: str
    """The most probable component; '' where none is named."""
    component_right: bool
    """Whether a visible cause lies in this component."""
    listed: Answer | None
    """The first cause of the list, whatever the verdict; None for an empty list."""
    inclusions: tuple[Answer, ...]
    """Whether each effect is part of the truth, from LEAST_INCLUSION up."""
    seconds: float | None
    """Time of the diagnosis [s]; None where there is none."""


def score_trial(label: Mapping[str, Any], diagnosis: Mapping[str, Any] | None) -> TrialScore:
    """The score of one trial.

    Args:
        label: content of sealed.json.
        diagnosis: content of gap.json; None: there is no diagnosis.
    """
    said = diagnosis or {"verdict": "failed"}
    causes, named, set_ = said.get("causes", []), named_cause(said), named_set(said)
    components = said.get("where", {}).get("component", {})
    component = max(components, key=components.get) if any(components.values()) else ""
    return TrialScore(
        number=label["trial"],
        kind=label["kind"] if label["kind"] == NOMINAL or label["visible"] else ABSORBED,
        causes=tuple(label["effects"]),
        explainable=label["gap"]["explainable"],
        verdict=said["verdict"],
        named=named,
        named_right=is_correct(label, named),
        tied=is_tied(label, said),
        truth_in_set=any(is_correct(label, effects) for effects in set_),
        set_size=len(set_),
        probability=sum(c["probability"] for c in causes if is_correct(label, c["effects"])),
        false_held=tuple(name for name in held_effects(said) if name not in label["effects"]),
        component=component,
        component_right=component in {component_of(cause) for cause in label["visible"]},
        listed=Answer(probability=causes[0]["probability"], right=is_true(label, causes[0]["effects"]))
        if causes
        else None,
        inclusions=tuple(
            Answer(probability=probability, right=name in label["effects"])
            for name, probability in said.get("inclusion", {}).items()
            if probability >= LEAST_INCLUSION
        ),
        seconds=said.get("seconds"),
    )


def held_effects(diagnosis: Mapping[str, Any]) -> tuple[str, ...]:
    """Effects that are surely part of the truth, the surest first."""
    found = diagnosis.get("inclusion", {})
    held = [name for name, probability in found.items() if probability >= HELD_PROBABILITY]
    return tuple(sorted(held, key=lambda name: -found[name]))


def named_cause(diagnosis: Mapping[str, Any]) -> tuple[str, ...]:
    """Effects that the verdict names; () where it names none.

    `known` and `ambiguous` name the first listed cause, `partial` all effects that are held.
    """
    if diagnosis["verdict"] == "partial":
        return held_effects(diagnosis)
    causes = diagnosis.get("causes", [])
    return tuple(causes[0]["effects"]) if diagnosis["verdict"] in NAMING_VERDICTS and causes else ()


def named_set(diagnosis: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Causes of the ambiguity set; what a `partial` without a set names; [] if nothing is named."""
    if diagnosis["verdict"] not in NAMING_VERDICTS:
        return []
    given = [tuple(effects) for effects in diagnosis.get("ambiguity_set", [])]
    named = named_cause(diagnosis)
    return given or ([named] if diagnosis["verdict"] == "partial" and named else [])


def is_tied(label: Mapping[str, Any], diagnosis: Mapping[str, Any]) -> bool:
    """Whether the first cause of `known` or `ambiguous` is as probable as a wrong one after it.

    Its place is then chance. A `partial` names what is held, which has no rival of the same probability.
    """
    causes = diagnosis.get("causes", [])
    if diagnosis["verdict"] not in ("known", "ambiguous") or len(causes) < 2:
        return False
    least = causes[0]["probability"] - TIE_MARGIN
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


def of_kind(trials: Sequence[TrialScore], *kinds: str) -> list[TrialScore]:
    """The trials of these kinds."""
    return [trial for trial in trials if trial.kind in kinds]


def is_alarmed(trial: TrialScore) -> bool:
    """Whether the diagnosis finds a gap."""
    return trial.verdict in (*NAMING_VERDICTS, "unknown")


def is_well_judged(trial: TrialScore) -> bool:
    """Whether the verdict is correct, and the first cause where there is one to name.

    Where the effect is struck, `unknown` is correct, or `partial` of truths.
    """
    if trial.kind in (NOMINAL, ABSORBED):
        return trial.verdict == "no_gap"
    if trial.kind == EXCLUDED_EFFECT:
        return trial.verdict == "unknown" or (trial.verdict == "partial" and not trial.false_held)
    return trial.named_right


def share(properties: Iterable[bool]) -> dict[str, Any]:
    """How many of how many cases are true, JSON-ready: value, exact 95 % interval, counts.

    The interval is Clopper and Pearson's (1934). Without cases the value is None.
    """
    cases = [bool(case) for case in properties]
    if not cases:
        return {"value": None, "low": 0.0, "high": 1.0, "hits": 0, "of": 0}
    test = binomtest(sum(cases), len(cases))
    low, high = test.proportion_ci()
    return {
        "value": sum(cases) / len(cases),
        "low": float(low),
        "high": float(high),
        "hits": sum(cases),
        "of": len(cases),
    }


def shares(trials: Sequence[TrialScore]) -> dict[str, dict[str, Any]]:
    """Shares of trials as `share` gives them; names as in results.json.

    Detection and cause are judged where there is something to explain.
    """
    caused, struck = of_kind(trials, ONE_CAUSE, TWO_EFFECTS), of_kind(trials, EXCLUDED_EFFECT)
    return {
        "false alarms without an effect": share(map(is_alarmed, of_kind(trials, NOMINAL))),
        "no gap where the four absorb it": share(map(is_well_judged, of_kind(trials, ABSORBED))),
        "detected": share(map(is_alarmed, [*caused, *struck])),
        "truth in the ambiguity set": share(t.truth_in_set for t in caused),
        "first cause right": share(t.named_right for t in caused),
        "first cause right, ties counted as wrong": share(t.named_right and not t.tied for t in caused),
        **{
            f"first cause right, {KIND_TITLES[kind]}": share(
                t.named_right for t in of_kind(trials, kind)
            )
            for kind in (ONE_CAUSE, TWO_EFFECTS)
        },
        "component right": share(t.component_right for t in caused),
        "component right where the effect is struck": share(t.component_right for t in struck),
        "unknown where the effect is struck": share(map(is_well_judged, struck)),
        "false effect held": share(bool(t.false_held) for t in trials),
        "failed": share(t.verdict == "failed" for t in trials),
    }


def means(trials: Sequence[TrialScore]) -> dict[str, float | None]:
    """Means over the trials; names as in results.json."""
    caused = of_kind(trials, ONE_CAUSE, TWO_EFFECTS)
    numbers = {
        "mean size of the ambiguity set": [t.set_size for t in caused if t.set_size],
        "mean probability on the truth": [t.probability for t in caused],
        "seconds per diagnosis": [t.seconds for t in trials if t.seconds is not None],
    }
    return {name: float(np.mean(values)) if values else None for name, values in numbers.items()}
