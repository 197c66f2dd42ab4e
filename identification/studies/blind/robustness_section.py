"""Diagnoses with and without a disturbance, for the report and as numbers."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from identification.report.page import Section, Table, Text, Verdict
from identification.studies.blind.answers import VERDICTS
from identification.studies.blind.disturbances import DISTURBANCES
from identification.studies.blind.kinds import KIND_TITLES, NOMINAL, ONE_CAUSE, TWO_EFFECTS
from identification.studies.blind.score import TrialScore
from identification.studies.blind.summary import confusion_matrix, is_alarmed
from identification.studies.proportion import Proportion

SAME_FIRST = "same first cause"
"""Of the trials in which the undisturbed diagnosis names a cause, those that name it again."""


@dataclass(frozen=True, kw_only=True)
class PairOfScores:
    """One trial, diagnosed without and with a disturbance."""

    before: TrialScore
    """Without."""
    after: TrialScore
    """With."""

    @property
    def same_first_cause(self) -> bool:
        """Whether both name the same effects; the order does not matter."""
        return set(self.before.first_cause) == set(self.after.first_cause)


def robustness_proportions(pairs: Sequence[PairOfScores]) -> dict[str, Proportion]:
    """Proportions of trials by name."""
    named = [pair for pair in pairs if pair.before.first_cause]
    caused = [pair for pair in pairs if pair.before.kind in (ONE_CAUSE, TWO_EFFECTS)]
    nominal = [pair for pair in pairs if pair.before.kind == NOMINAL]
    return {
        SAME_FIRST: Proportion.count(named, lambda p: p.same_first_cause),
        "same first cause in the list": Proportion.count(
            named, lambda p: set(p.before.first_listed) == set(p.after.first_listed)
        ),
        "same verdict": Proportion.count(pairs, lambda p: p.before.verdict == p.after.verdict),
        "false alarms without an effect": Proportion.count(nominal, lambda p: is_alarmed(p.after)),
        "... undisturbed": Proportion.count(nominal, lambda p: is_alarmed(p.before)),
        "first cause right, ties counted as wrong": Proportion.count(
            caused, lambda p: _is_right(p.after)
        ),
        "... of it undisturbed": Proportion.count(caused, lambda p: _is_right(p.before)),
        "false effect held": Proportion.count(pairs, lambda p: bool(p.after.false_held)),
    }


def robustness_section(disturbance: str, pairs: Sequence[PairOfScores]) -> Section:
    """Shares, changes of verdict, and the trials whose answer changed."""
    found = robustness_proportions(pairs)
    same = found[SAME_FIRST]
    all_same = same.hits == same.of
    return Section(
        title=f"Blind check under {disturbance}: {DISTURBANCES[disturbance]}",
        verdicts=[
            Verdict(
                status="note" if not same.of else "good" if all_same else "bad",
                text=f"{SAME_FIRST} as undisturbed: {same.hits} of {same.of} trials (asked: all)",
            )
        ],
        blocks=[
            Text(
                text="The trials of the study, diagnosed again. Same first cause: of the trials in "
                "which the undisturbed diagnosis names a cause, those in which the disturbed one names "
                "the same."
            ),
            _share_table(found),
            _verdict_table(pairs),
            _changed(pairs),
        ],
    )


def robustness_json(disturbance: str, pairs: Sequence[PairOfScores], *, seed: int) -> dict[str, Any]:
    """Everything that was counted, and each trial."""
    return {
        "disturbance": disturbance,
        "seed": seed,
        "trials": len(pairs),
        "shares": {name: found.as_json() for name, found in robustness_proportions(pairs).items()},
        "verdicts": {
            verdict: dict(zip(VERDICTS, counts, strict=True))
            for verdict, counts in zip(VERDICTS, _verdict_changes(pairs), strict=True)
        },
        "each": [
            {
                "number": pair.before.number,
                "kind": pair.before.kind,
                "effects": pair.before.causes,
                "verdicts": [pair.before.verdict, pair.after.verdict],
                "first": [pair.before.first_cause, pair.after.first_cause],
                "first_listed": [pair.before.first_listed, pair.after.first_listed],
            }
            for pair in pairs
        ],
    }


def _is_right(trial: TrialScore) -> bool:
    return trial.first_cause_correct and not trial.tied


def _verdict_changes(pairs: Sequence[PairOfScores]) -> list[list[int]]:
    """Number of trials by undisturbed (rows) and disturbed verdict (columns), both as VERDICTS."""
    changes = ((pair.before.verdict, pair.after.verdict) for pair in pairs)
    return confusion_matrix(changes, VERDICTS, VERDICTS).tolist()


def _share_table(found: dict[str, Proportion]) -> Table:
    rows = [
        [
            name,
            "-" if share.value is None else f"{share.value:.3f}",
            "{:.3f} to {:.3f}".format(*share.interval),
            f"{share.hits} of {share.of}",
        ]
        for name, share in found.items()
    ]
    caption = "Shares with exact 95 % intervals (Clopper-Pearson)."
    return Table(columns=["", "value", "95 % interval", "trials"], rows=rows, caption=caption)


def _verdict_table(pairs: Sequence[PairOfScores]) -> Table:
    rows = [
        [verdict, *(str(count) for count in counts)]
        for verdict, counts in zip(VERDICTS, _verdict_changes(pairs), strict=True)
        if any(counts)
    ]
    return Table(columns=["Undisturbed", *VERDICTS], rows=rows, caption="Verdicts, disturbed.")


def _changed(pairs: Sequence[PairOfScores]) -> Table | Text:
    """The trials whose answer changed, or a sentence that there are none."""
    rows = [
        [
            f"{pair.before.number:04d}",
            KIND_TITLES[pair.before.kind],
            " + ".join(pair.before.causes) or "-",
            *(f"{t.verdict}: {' + '.join(t.first_cause) or '-'}" for t in (pair.before, pair.after)),
        ]
        for pair in pairs
        if not pair.same_first_cause or pair.before.verdict != pair.after.verdict
    ]
    if not rows:
        return Text(text="All answers stayed the same.")
    columns = ["Trial", "kind", "truth", "undisturbed", "disturbed"]
    return Table(columns=columns, rows=rows, caption="Trials whose answer changed.")
