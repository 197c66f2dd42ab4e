"""All trials together: proportions with exact intervals, and means."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.studies.blind.answers import NAMING_VERDICTS, VERDICTS
from identification.studies.blind.calibration import (
    EQUAL_WIDTH,
    FIRST,
    answers_by_trial,
    calibration_errors,
)
from identification.studies.blind.kinds import (
    ABSORBED,
    EXCLUDED_EFFECT,
    KIND_TITLES,
    NOMINAL,
    ONE_CAUSE,
    TWO_EFFECTS,
)
from identification.studies.blind.score import TrialScore
from identification.studies.blind.settings import DEFAULTS, BlindSettings
from identification.studies.proportion import Proportion


def proportions(
    trials: Sequence[TrialScore], settings: BlindSettings = DEFAULTS
) -> dict[str, Proportion]:
    """Proportions of trials; names as in results.json.

    Detection and cause are judged where there is something to explain.
    """
    caused, excluded = of_kind(trials, ONE_CAUSE, TWO_EFFECTS), of_kind(trials, EXCLUDED_EFFECT)
    return {
        "false alarms without an effect": Proportion.count(of_kind(trials, NOMINAL), is_alarmed),
        **_absorbed_proportions(of_kind(trials, ABSORBED)),
        "detected": Proportion.count([*caused, *excluded], is_alarmed),
        **_cause_proportions(caused, settings),
        "component right": Proportion.count(caused, lambda t: t.component_correct),
        "component right where the effect is struck": Proportion.count(
            excluded, lambda t: t.component_correct
        ),
        "unknown where the effect is struck": Proportion.count(excluded, _names_nothing_false),
        **_false_effect_proportions(trials),
        "size inside its interval": Proportion.count(
            [estimate for trial in caused for estimate in trial.size_estimates], lambda e: e.inside
        ),
        "shrink inside its 90 % interval": Proportion.count(
            [trial.gap_reduction for trial in caused if trial.gap_reduction], lambda r: r.inside
        ),
        "failed": Proportion.count(trials, lambda t: t.verdict == "failed"),
    }


def means(trials: Sequence[TrialScore]) -> dict[str, float | None]:
    """Means, a median and a maximum over the trials; names as in results.json."""
    caused = of_kind(trials, ONE_CAUSE, TWO_EFFECTS)
    sets = [trial.set_size for trial in caused if trial.set_size]
    errors = [estimate.error for trial in caused for estimate in trial.size_estimates]
    seconds = [trial.seconds for trial in trials if trial.seconds is not None]
    return {
        "mean size of the ambiguity set": _or_none(np.mean, sets),
        "mean probability on the truth": _or_none(np.mean, [t.probability for t in caused]),
        "median relative error of a size": _or_none(np.median, errors),
        "seconds per diagnosis": _or_none(np.mean, seconds),
        "longest diagnosis [s]": _or_none(np.max, seconds),
    }


def named_values(
    trials: Sequence[TrialScore], settings: BlindSettings = DEFAULTS
) -> dict[str, float | None]:
    """Every proportion, mean and criterion by name; None where there is nothing to count."""
    values = {name: found.value for name, found in proportions(trials, settings).items()}
    errors = calibration_errors(answers_by_trial(trials)[FIRST], settings)
    error = errors[EQUAL_WIDTH].value if errors else None
    return values | means(trials) | {"calibration error of the first cause": error}


def verdict_matrix(trials: Sequence[TrialScore]) -> NDArray:
    """Number of trials of each kind (rows, as KIND_TITLES) and verdict (columns, as VERDICTS)."""
    pairs = ((trial.kind, trial.verdict) for trial in trials)
    return confusion_matrix(pairs, tuple(KIND_TITLES), VERDICTS)


def confusion_matrix(
    pairs: Iterable[tuple[str, str]], rows: Sequence[str], columns: Sequence[str]
) -> NDArray:
    """Number of each (true, diagnosed) pair, (rows, columns)."""
    counts = np.zeros((len(rows), len(columns)), dtype=int)
    for true, diagnosed in pairs:
        counts[rows.index(true), columns.index(diagnosed)] += 1
    return counts


def is_well_judged(trial: TrialScore) -> bool:
    """Whether the verdict is correct, and the first cause where there is one to name."""
    if trial.kind in (NOMINAL, ABSORBED):
        return trial.verdict == "no_gap"
    if trial.kind == EXCLUDED_EFFECT:
        return _names_nothing_false(trial)
    return trial.first_cause_correct


def _absorbed_proportions(absorbed: Sequence[TrialScore]) -> dict[str, Proportion]:
    return {
        "no gap where the four absorb it": Proportion.count(absorbed, lambda t: t.verdict == "no_gap"),
        "false cause where the four absorb it": Proportion.count(
            absorbed, lambda t: is_alarmed(t) and not set(t.first_cause) <= set(t.causes)
        ),
    }


def _false_effect_proportions(trials: Sequence[TrialScore]) -> dict[str, Proportion]:
    """Trials with an effect that is held and is not part of the truth, all and by kind."""
    groups = {"": trials} | {f", {KIND_TITLES[kind]}": of_kind(trials, kind) for kind in KIND_TITLES}
    return {
        f"false effect held{name}": Proportion.count(group, lambda t: bool(t.false_held))
        for name, group in groups.items()
    }


def _cause_proportions(caused: Sequence[TrialScore], settings: BlindSettings) -> dict[str, Proportion]:
    limit = settings.distinguishable_distance
    groups = {
        "first cause right": caused,
        "first cause right, where data can tell": [
            trial for trial in caused if trial.rival_distance is None or trial.rival_distance >= limit
        ],
        "first cause right, one cause": of_kind(caused, ONE_CAUSE),
        "first cause right, two effects": of_kind(caused, TWO_EFFECTS),
    }
    return {
        "truth in the ambiguity set": Proportion.count(caused, lambda t: t.truth_in_set),
        **{
            name: Proportion.count(group, lambda t: t.first_cause_correct)
            for name, group in groups.items()
        },
        "first cause right, ties counted as wrong": Proportion.count(
            caused, lambda t: t.first_cause_correct and not t.tied
        ),
    }


def _names_nothing_false(trial: TrialScore) -> bool:
    """Whether a verdict leaves open what it cannot know: `unknown`, or `partial` of truths."""
    return trial.verdict == "unknown" or (trial.verdict == "partial" and not trial.false_held)


def is_alarmed(trial: TrialScore) -> bool:
    """Whether the diagnosis finds a gap."""
    return trial.verdict in (*NAMING_VERDICTS, "unknown")


def of_kind(trials: Sequence[TrialScore], *kinds: str) -> list[TrialScore]:
    """The trials of these kinds."""
    return [trial for trial in trials if trial.kind in kinds]


def _or_none(function: Callable[[list], Any], numbers: list) -> float | None:
    return float(function(numbers)) if numbers else None
