"""One diagnosis scored against its label: what is correct. Functions of both files' contents."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from epv_env.plant.effects.registry import effect
from identification.studies.blind.answers import (
    held_effects,
    inclusion,
    is_correct,
    is_tied,
    is_true,
    named_cause,
    named_set,
)
from identification.studies.blind.gap_reduction import GapReduction
from identification.studies.blind.kinds import ABSORBED, NOMINAL, PARAMETER
from identification.studies.blind.settings import DEFAULTS, BlindSettings
from identification.studies.blind.size_estimates import SizeEstimate, size_estimates
from identification.valve_gap.causes import PARAMETER_COMPONENTS


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
    verdict: str
    """One of VERDICTS."""
    first_cause: tuple[str, ...]
    """Effects that the verdict names (`answers.named_cause`); () where none is named."""
    first_cause_correct: bool
    """Whether a cause is named and the most probable one is correct."""
    tied: bool
    """Whether a wrong cause is as probable as the first one (`answers.is_tied`)."""
    truth_in_set: bool
    """Whether the ambiguity set holds a correct cause."""
    set_size: int
    """Causes in the ambiguity set [-]; 0 where no cause is named."""
    probability: float
    """Sum over the correct causes [-]."""
    false_held: tuple[str, ...]
    """Effects that are held as surely present and are not part of the truth."""
    first_listed: tuple[str, ...]
    """Effects of the first cause of the list, whatever the verdict; () for an empty list."""
    listed: Answer | None
    """The first cause of the list, whatever the verdict; None for an empty list."""
    inclusions: tuple[Answer, ...]
    """Whether each effect is part of the truth, from `least_inclusion` up."""
    component: str
    """The most probable component; '' where none is named."""
    component_correct: bool
    """Whether a visible cause lies in this component."""
    rival_distance: float | None
    """Of `rival_distance` [noise deviations]."""
    explainable_gap: float
    """Noise-free gap that no unit of the nominal design explains [-]."""
    size_estimates: tuple[SizeEstimate, ...]
    """Sizes of the correct cause, where a cause is named."""
    gap_reduction: GapReduction | None
    """Of `true_gap_reduction`."""
    seconds: float | None
    """Time of the diagnosis [s]; None where there is none."""


def score_trial(
    label: Mapping[str, Any],
    diagnosis: Mapping[str, Any] | None,
    gap_reduction: GapReduction | None,
    distance: float | None = None,
    settings: BlindSettings = DEFAULTS,
) -> TrialScore:
    """The score of one trial.

    Args:
        label: content of sealed.json.
        diagnosis: content of gap.json (docs/reference/gap-json.md); None: there is no diagnosis.
        gap_reduction: of `true_gap_reduction`.
        distance: of `rival_distance` [noise deviations].
        settings: which effects are held, and what a tie is.
    """
    said = diagnosis or {"verdict": "failed"}
    causes = said.get("causes", [])
    correct = [cause for cause in causes if is_correct(label, cause["effects"])]
    named, set_ = named_cause(said, settings), named_set(said, settings)
    held = held_effects(said, settings)
    component = _most_probable_component(said)
    kind = label["kind"]
    return TrialScore(
        number=label["trial"],
        kind=kind if kind == NOMINAL or label["visible"] else ABSORBED,
        causes=tuple(label["effects"]),
        verdict=said["verdict"],
        first_cause=named,
        first_cause_correct=is_correct(label, named),
        tied=is_tied(label, said, settings),
        truth_in_set=any(is_correct(label, effects) for effects in set_),
        set_size=len(set_),
        probability=sum(cause["probability"] for cause in correct),
        false_held=tuple(effect for effect in held if effect not in label["effects"]),
        first_listed=tuple(causes[0]["effects"]) if causes else (),
        listed=_listed(label, causes[0]) if causes else None,
        inclusions=_inclusions(label, said, settings),
        component=component,
        component_correct=component in {component_of(cause) for cause in label["visible"]},
        rival_distance=distance,
        explainable_gap=label["gap"]["explainable"],
        size_estimates=tuple(size_estimates(label, correct[0])) if correct and named else (),
        gap_reduction=gap_reduction,
        seconds=said.get("seconds"),
    )


def component_of(cause: str) -> str:
    """Component in which a cause lies."""
    if cause.startswith(PARAMETER):
        return PARAMETER_COMPONENTS[cause.removeprefix(PARAMETER)]
    return effect(cause).component


def _listed(label: Mapping[str, Any], cause: Mapping[str, Any]) -> Answer:
    return Answer(probability=cause["probability"], right=is_true(label, cause["effects"]))


def _inclusions(
    label: Mapping[str, Any], diagnosis: Mapping[str, Any], settings: BlindSettings
) -> tuple[Answer, ...]:
    return tuple(
        Answer(probability=probability, right=name in label["effects"])
        for name, probability in inclusion(diagnosis).items()
        if probability >= settings.least_inclusion
    )


def _most_probable_component(diagnosis: Mapping[str, Any]) -> str:
    components = diagnosis.get("where", {}).get("component", {})
    return max(components, key=components.get) if any(components.values()) else ""
