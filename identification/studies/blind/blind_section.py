"""The results of a blind check, for the report and as numbers."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

from identification.report.page import Picture, Section, Table, Text, Verdict
from identification.studies.blind.acceptance import CRITERIA_OF_FORMS, AcceptanceCriterion
from identification.studies.blind.answers import VERDICTS
from identification.studies.blind.blind_figures import (
    cause_figure,
    component_figure,
    detection_figure,
)
from identification.studies.blind.calibration_section import calibration_blocks, calibration_json
from identification.studies.blind.detection import detection_by_gap
from identification.studies.blind.kinds import KIND_TITLES
from identification.studies.blind.score import TrialScore
from identification.studies.blind.settings import DEFAULTS, BlindSettings
from identification.studies.blind.summary import (
    is_well_judged,
    means,
    named_values,
    proportions,
    verdict_matrix,
)
from identification.studies.proportion import Proportion

METHOD = (
    "Each truth was drawn, and its hash was published, before another process that had the campaign "
    "alone diagnosed it. The bench's forms of the effects, its solver and its steps differ from the "
    "fitted ones. A trial has nothing to explain if its noise-free gap falls below {threshold:g} when "
    "the four parameters are recalibrated and the others vary within their scatter: no_gap is correct "
    "there. A cause is correct if it names all of the truth that exceeds this threshold, and nothing "
    "that is untrue. The verdict `partial` names the effects whose probability of being part of the "
    "truth is {held:g} or more (held). Causes whose probabilities differ by {tie:g} or less are tied."
)


def blind_section(trials: Sequence[TrialScore], settings: BlindSettings = DEFAULTS) -> Section:
    """Acceptance criteria, the matrix of verdicts, confusion and detection."""
    values = named_values(trials, settings)
    return Section(
        title=f"Blind check over {len(trials)} trials, {settings.forms} forms",
        verdicts=[
            _criterion_verdict(criterion, values[criterion.name])
            for criterion in CRITERIA_OF_FORMS[settings.forms]
        ],
        blocks=[
            Text(
                text=METHOD.format(
                    threshold=settings.explainable_threshold,
                    held=settings.held_probability,
                    tie=settings.tie_margin,
                )
            ),
            _verdict_table(trials),
            _value_table(trials, settings),
            Picture(
                figure=detection_figure(trials, settings),
                caption="Detection against the explainable gap; error bars: exact 95 % intervals.",
            ),
            *calibration_blocks(trials, settings),
            Picture(figure=component_figure(trials), caption="Components of single causes."),
            Picture(figure=cause_figure(trials), caption="Single causes, and the first one named."),
            _misjudged_table(trials),
        ],
    )


def blind_json(
    trials: Sequence[TrialScore], *, seed: int, settings: BlindSettings = DEFAULTS
) -> dict[str, Any]:
    """Everything that was counted, and each trial: the content of results.json."""
    values = named_values(trials, settings)
    verdicts = zip(KIND_TITLES, verdict_matrix(trials).tolist(), strict=True)
    return {
        "seed": seed,
        "forms": settings.forms,
        "trials": len(trials),
        "bars": {
            criterion.name: criterion.is_met(values[criterion.name])
            for criterion in CRITERIA_OF_FORMS[settings.forms]
        },
        "shares": {name: found.as_json() for name, found in proportions(trials, settings).items()},
        "means": means(trials),
        "verdicts": {kind: dict(zip(VERDICTS, counts, strict=True)) for kind, counts in verdicts},
        "calibration": calibration_json(trials, settings),
        "false_held": dict(Counter(t.kind for t in trials for _ in t.false_held)),
        "detection": [
            {
                "low": bin_.low,
                "high": bin_.high,
                "detected": bin_.detected.as_json(),
                "first_right": bin_.first_cause_correct.as_json(),
            }
            for bin_ in detection_by_gap(trials, settings)
        ],
        "each": [_trial_json(trial) for trial in trials],
    }


def _criterion_verdict(criterion: AcceptanceCriterion, value: float | None) -> Verdict:
    met = criterion.is_met(value)
    text = "not measured" if value is None else f"{value:.3g}"
    status = "note" if met is None else "good" if met else "bad"
    return Verdict(status=status, text=f"{criterion.name}: {text} (asked: {criterion.requirement})")


def _verdict_table(trials: Sequence[TrialScore]) -> Table:
    rows = [
        [title, *(str(count) for count in counts)]
        for title, counts in zip(KIND_TITLES.values(), verdict_matrix(trials).tolist(), strict=True)
    ]
    return Table(columns=["Truth", *VERDICTS], rows=rows, caption="Verdicts.")


def _value_table(trials: Sequence[TrialScore], settings: BlindSettings) -> Table:
    rows = [[name, *_cells(found)] for name, found in proportions(trials, settings).items()]
    rows += [[n, "-" if v is None else f"{v:.3g}", "", ""] for n, v in means(trials).items()]
    caption = "Shares with exact 95 % intervals (Clopper-Pearson), and means."
    return Table(columns=["", "value", "95 % interval", "trials"], rows=rows, caption=caption)


def _cells(proportion: Proportion) -> list[str]:
    low, high = proportion.interval
    value = "-" if proportion.value is None else f"{proportion.value:.3f}"
    return [value, f"{low:.3f} to {high:.3f}", f"{proportion.hits} of {proportion.of}"]


def _misjudged_table(trials: Sequence[TrialScore]) -> Table:
    rows = [
        [
            f"{trial.number:04d}",
            KIND_TITLES[trial.kind],
            " + ".join(trial.causes) or "-",
            f"{trial.explainable_gap:.3f}",
            trial.verdict,
            " + ".join(trial.first_cause) or "-",
            f"{trial.probability:.2f}",
        ]
        for trial in trials
        if not is_well_judged(trial)
    ]
    columns = ["Trial", "kind", "truth", "explainable", "verdict", "first cause", "p(truth)"]
    return Table(columns=columns, rows=rows, caption="Trials that were judged wrong.")


def _trial_json(trial: TrialScore) -> dict[str, Any]:
    reduction = trial.gap_reduction
    return {
        "number": trial.number,
        "kind": trial.kind,
        "effects": trial.causes,
        "verdict": trial.verdict,
        "first": trial.first_cause,
        "first_right": trial.first_cause_correct,
        "tied": trial.tied,
        "false_held": trial.false_held,
        "in_set": trial.truth_in_set,
        "set_size": trial.set_size,
        "probability": trial.probability,
        "component": trial.component,
        "component_right": trial.component_correct,
        "rival": trial.rival_distance,
        "explainable": trial.explainable_gap,
        "seconds": trial.seconds,
        "magnitudes": [vars(estimate) for estimate in trial.size_estimates],
        "shrink": vars(reduction) if reduction else None,
    }
