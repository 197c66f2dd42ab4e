"""Follow the operation log of a valve: has it changed, since when, what is it, and is it mended.

    epv monitor logs/valve-00 --out runs/monitor
    epv monitor logs/valve-00 --plant runs/monitor/learnt/plant.json --out runs/later

The valve is learnt from the first drives, in a minute or two, and then watched. With `--plant` it is
known. The guide is docs/how-to/monitor-a-valve.md.
"""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from epv_env.common.command_line import NextStep, beside
from epv_env.common.options import Folder, Number, PlantFile, Seed
from identification.gap.diagnosis import Diagnosis
from identification.gap.judge.verdict import KNOWN, NO_GAP, UNKNOWN
from identification.gap.report.sentences import in_words, listed, probability_text, quantity
from identification.gap.search.onset import Onset
from identification.recordings.openings import drive_of
from identification.report.page import Picture, Section, Verdict, write_page
from identification.valve_gap.diagnose import REPORT
from identification.valve_gap.monitor import Monitored, monitor_log

LEARN = 3
"""Drives from which a valve is learnt that no plant file describes."""
NAMED_DRIVES = 12
"""Most drives that the picture names."""


@dataclass(frozen=True)
class Options:
    """The log, the valve or how to learn it, and where the results go."""

    log: Annotated[Path, "folder with log.json (docs/reference/files.md)"]
    _: KW_ONLY
    learn: Annotated[
        int | None,
        Number(int, 0, 1000),
        f"first drives from which the valve is learnt (default: {LEARN}, or 0 with --plant)",
    ] = None
    out: Folder = Path("runs/monitor")
    plant: Annotated[PlantFile, "plant file of the valve; default: the report's calibration"] = None
    seed: Annotated[Seed, "of resampling"] = 0


def run(options: Options) -> None:
    """Write the page, and say what was found. Raises ValueError."""
    learn = options.learn if options.learn is not None else 0 if options.plant else LEARN
    heard = monitor_log(options.log, options.out, plant=options.plant, learn=learn, seed=options.seed)
    found = verdicts(heard)
    write_page(
        options.out / REPORT,
        title=f"Has the valve changed: {heard.log.name}",
        sections=[Section(title="Verdict", summary=True, verdicts=found, blocks=pictures(heard))],
        facts={
            "Log": f"{heard.log.name}, {len(heard.log.drives)} drives",
            "Valve": f"learnt from {learn} drives" if learn else f"{options.plant or 'the report'}",
        },
        next_step=next_step(options),
    )
    print(*(verdict.text for verdict in found), sep="\n")
    print(f"written: {options.out / REPORT}")


def next_step(options: Options) -> NextStep:
    """Watch the drives that follow."""
    words = ("monitor", options.log, "--out", beside(options.out, "later"))
    return NextStep("once more drives are logged", words, options.plant)


def verdicts(heard: Monitored) -> list[Verdict]:
    """How the valve began, then a sentence or two for each change."""
    told, found = [_beginning(heard.learnt)] if heard.learnt else [], heard.found
    changes = found.onsets_of(found.best) if found and found.best else {}
    if found and changes:
        return told + [_change(found, label, onset) for label, onset in changes.items()]
    if found and found.best and not heard.learnt:
        return [_verdict(found, f"In all drives the valve differs from its plant file: {_what(found)}.")]
    return [*told, Verdict(status="good", text="No drive shows a change of the valve.")]


def _beginning(learnt: Diagnosis) -> Verdict:
    """How the valve differs from the plant with which learning began."""
    drives = list(dict.fromkeys(drive_of(run.name) for run in learnt.ranking.problem.plant.runs))
    text = f"The valve is learnt from {drives[0]} to {drives[-1]}"
    if learnt.onset:
        return Verdict(status="note", text=f"{text}, in which it changes.")
    if learnt.best:
        return _verdict(
            learnt, f"{text}. It differs from the start, and is the reference: {_what(learnt)}."
        )
    return _verdict(learnt, f"{text}: nothing but its calibrated parameters is other than usual.")


def _change(found: Diagnosis, label: str, onset: Onset) -> Verdict:
    """Since when, what, how sure, and whether it is mended."""
    since = f"since {onset.drive} ({probability_text(onset.probability)})"
    if onset.earliest != onset.latest:
        since = f"since a drive from {onset.earliest} to {onset.latest} (95 %)"
    text = f"The valve has changed {since}: {_what(found, label)}."
    if _is_gone(found, label):
        text = f"What the valve differed by is gone {since}: {in_words(found, label)}."
    return _verdict(found, text + (f" It is mended since {onset.mended}." if onset.mended else ""))


def _verdict(found: Diagnosis, text: str) -> Verdict:
    sure = found.conclusion.verdict in (KNOWN, NO_GAP)
    return Verdict(status="note" if sure else "doubt", text=text)


def _what(found: Diagnosis, label: str = "") -> str:
    """The likeliest causes, or one of them by its label: sizes, how sure they are, and what else."""
    best, ranking = found.best, found.ranking
    assert best
    estimate, values = best.hypothesis.estimate, ranking.problem.values(best.hypothesis.estimate)
    own = [cause for cause in estimate.hypothesis.causes if label in ("", cause.label)]
    sizes = [quantity(values[p.symbol], p.unit) for cause in own for p in cause.sizes]
    name = f"{listed([cause.title for cause in own])} of {listed(sizes)}"
    if found.conclusion.verdict == UNKNOWN:
        chance = probability_text(ranking.unknown)
        return f"something outside the catalogue ({chance}), to which the nearest is {name}"
    rivals = [
        f"{in_words(found, ' + '.join(each.effects))} ({probability_text(each.probability)})"
        for each in found.conclusion.ambiguity_set[1:]
    ]
    return " or ".join([f"{name} ({probability_text(best.probability)})", *rivals])


def _is_gone(found: Diagnosis, label: str) -> bool:
    """Whether a change takes back an effect that the valve had when it was learnt."""
    problem = found.ranking.problem
    values = problem.values(found.best.hypothesis.estimate)  # type: ignore[union-attr]
    (cause,) = (cause for cause in problem.plant.causes if cause.label == label)
    had = [p for p in cause.sizes if p.nominal and not label.startswith("parameter:")]
    return bool(had) and all(abs(values[p.symbol]) < abs(p.nominal) / 2.0 for p in had)


def pictures(heard: Monitored) -> list[Picture]:
    """How far each drive is from the valve as it began, and from the valve with what was found."""
    found = heard.found or heard.learnt
    if not found:
        return []
    models = {"the same valve in all drives": found.ranking.recalibrated}
    models |= {"with what was found": found.best.hypothesis} if found.best else {}
    gaps = {name: gap_of_drives(found, model.residuals) for name, model in models.items()}
    drives = list(next(iter(gaps.values())))
    figure = Figure(figsize=(7.0, 3.0), layout="constrained")
    axes = figure.subplots()
    for number, (name, own) in enumerate(gaps.items()):
        axes.bar(np.arange(len(drives)) + 0.4 * number, list(own.values()), 0.38, label=name)
    named = range(0, len(drives), -(-len(drives) // NAMED_DRIVES))
    axes.set_xticks(list(named), [Path(drives[k]).stem for k in named], rotation=30, ha="right")
    axes.axhline(1.0, color="0.4", linewidth=0.8, linestyle="--")
    axes.set_ylabel("gap [noise deviations]")
    figure.legend(loc="outside upper left", ncols=2, frameon=False)
    caption = "Gap between the model and each drive; dashed: what noise alone leaves."
    return [Picture(figure=figure, caption=caption)]


def gap_of_drives(found: Diagnosis, residuals: Sequence[NDArray]) -> dict[str, float]:
    """Root mean square of the runs' residuals in each drive [noise deviations]."""
    squares, readings = dict[str, float](), dict[str, int]()
    for run, residual in zip(found.ranking.problem.plant.runs, residuals, strict=True):
        drive = drive_of(run.name)
        squares[drive] = squares.get(drive, 0.0) + float(np.sum(residual**2))
        readings[drive] = readings.get(drive, 0) + int(np.sum(run.trusted))
    return {drive: float(np.sqrt(squares[drive] / max(readings[drive], 1))) for drive in squares}
