"""What a blind check found, for the report and as numbers."""

from collections.abc import Sequence
from typing import Any

from identification.report.page import Picture, Section, Table, Text, Verdict
from identification.studies.blind import blind_figures as figures
from identification.studies.blind.commitments import NOTHING_LEFT
from identification.studies.blind.score import VERDICTS, Scored, row_of
from identification.studies.blind.summary import (
    BARS,
    KINDS,
    Bar,
    Share,
    by_size,
    means,
    shares,
    values,
    verdict_matrix,
)

HOW = (
    "Each truth was drawn and sealed, and its hash given away, before another process that had the "
    "campaign alone diagnosed it. The bench's forms of the effects, its solver and its steps differ "
    f"from the fitted ones. A trial whose noise-free gap falls below {NOTHING_LEFT:g} when the four "
    "parameters are recalibrated and the others give way within their scatter has nothing to explain: "
    "no_gap is right there. A cause is right if it names all of the truth that is above that, and "
    "nothing that is untrue."
)


def blind_section(trials: Sequence[Scored]) -> Section:
    """Verdicts against the bars, the matrix of verdicts, confusion, detection."""
    found = values(trials)
    return Section(
        title=f"Blind check over {len(trials)} trials",
        verdicts=[_held(bar, found[bar.name]) for bar in BARS],
        blocks=[
            Text(text=HOW),
            _matrix(trials),
            _numbers(trials),
            Picture(
                figure=figures.detection(trials),
                caption="Detection against what there is to explain; bars: exact 95 % intervals.",
            ),
            Picture(figure=figures.components(trials), caption="Components of single causes."),
            Picture(figure=figures.causes(trials), caption="Single causes, and the first one named."),
            _missed(trials),
        ],
    )


def blind_json(trials: Sequence[Scored], *, seed: int) -> dict[str, Any]:
    """Everything that was counted, and each trial."""
    found = values(trials)
    return {
        "seed": seed,
        "trials": len(trials),
        "bars": {bar.name: bar.met(found[bar.name]) for bar in BARS},
        "shares": {name: share.as_json() for name, share in shares(trials).items()},
        "means": means(trials),
        "verdicts": dict(
            zip(
                KINDS,
                (dict(zip(VERDICTS, row, strict=True)) for row in verdict_matrix(trials).tolist()),
                strict=True,
            )
        ),
        "detection": [
            {
                "low": bin_.low,
                "high": bin_.high,
                "detected": bin_.detected.as_json(),
                "first_right": bin_.first_right.as_json(),
            }
            for bin_ in by_size(trials)
        ],
        "each": [_trial(trial) for trial in trials],
    }


def _held(bar: Bar, value: float | None) -> Verdict:
    met = bar.met(value)
    asked = f"at least {bar.least:g}" if bar.most == float("inf") else f"at most {bar.most:g}"
    if bar.least > 0 and bar.most < float("inf"):
        asked = f"{bar.least:g} to {bar.most:g}"
    text = "not measured" if value is None else f"{value:.3g}"
    status = "note" if met is None else "good" if met else "bad"
    return Verdict(status=status, text=f"{bar.name}: {text} (asked: {asked})")


def _matrix(trials: Sequence[Scored]) -> Table:
    rows = [
        [row_of(kind), *(str(count) for count in counts)]
        for kind, counts in zip(KINDS, verdict_matrix(trials).tolist(), strict=True)
    ]
    return Table(columns=["Truth", *VERDICTS], rows=rows, caption="Verdicts.")


def _numbers(trials: Sequence[Scored]) -> Table:
    rows = [[name, *_cells(share)] for name, share in shares(trials).items()]
    rows += [[n, "-" if v is None else f"{v:.3g}", "", ""] for n, v in means(trials).items()]
    caption = "Shares with exact 95 % intervals (Clopper-Pearson), and means."
    return Table(columns=["", "value", "95 % interval", "trials"], rows=rows, caption=caption)


def _cells(share: Share) -> list[str]:
    low, high = share.interval
    value = "-" if share.value is None else f"{share.value:.3f}"
    return [value, f"{low:.3f} to {high:.3f}", f"{share.hits} of {share.of}"]


def _missed(trials: Sequence[Scored]) -> Table:
    rows = [
        [
            f"{trial.number:04d}",
            row_of(trial.kind),
            " + ".join(trial.effects) or "-",
            f"{trial.explainable:.3f}",
            trial.verdict,
            " + ".join(trial.first) or "-",
            f"{trial.probability:.2f}",
        ]
        for trial in trials
        if not well_judged(trial)
    ]
    columns = ["Trial", "kind", "truth", "explainable", "verdict", "first cause", "p(truth)"]
    return Table(columns=columns, rows=rows, caption="Trials that were judged wrong.")


def well_judged(trial: Scored) -> bool:
    """Whether the verdict is the right one, with the truth first where there is one to name."""
    if trial.kind in ("none", "absorbed"):
        return trial.verdict == "no_gap"
    if trial.kind == "left_out":
        return trial.verdict == "unknown"
    return trial.first_right


def _trial(trial: Scored) -> dict[str, Any]:
    shrink = trial.shrink
    return {
        **{name: value for name, value in vars(trial).items() if name not in ("magnitudes", "shrink")},
        "magnitudes": [vars(magnitude) for magnitude in trial.magnitudes],
        "shrink": vars(shrink) if shrink else None,
    }
