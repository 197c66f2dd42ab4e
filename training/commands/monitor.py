"""Follow the operation log of a valve with a monitor: has it changed, when, and what.

    epv monitor logs/valve-00 --out runs/monitor
    epv monitor logs/valve-01 --plant runs/plant.json --out runs/monitor
    epv monitor logs/valve-02 --model runs/monitor/monitor.json

What the monitor knows of the report's valve is shipped. Another plant is simulated first, with every
effect of the catalogue: a minute or two, once.
"""

from collections.abc import Collection, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Any, TypedDict

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from controllers.monitor import RETURN, SHIPPED, UNKNOWN, Change, Monitor, MonitorModel
from epv_env.common.command_line import NextStep, beside
from epv_env.common.files import read_json
from epv_env.common.options import Folder, Number, PlantFile, Seed
from epv_env.common.units import BAR
from epv_env.plant.plantfile import load_plant
from identification.gap.report.gap_json import FORMAT
from identification.recordings.log_files import Log, read_log
from identification.recordings.recording import rules_of
from training.evaluation.plots import save_figure
from training.monitoring import monitor_model

MODEL, FIGURE = "monitor.json", "monitor.png"
"""What is written."""
START = 1.0
"""Time up to which a change has come before the start [s]."""
LIKELY = 0.05
"""Probability from which a cause is named."""


class _Began(TypedDict):
    drive: str
    earliest: str
    latest: str


class _Cause(TypedDict):
    effects: list[str]
    onset: dict[str, _Began]


class _Levels(TypedDict):
    form: dict[str, Any]


class _Finding(TypedDict):
    """What is compared of gap.json."""

    verdict: str
    ambiguity_set: list[list[str]]
    absorbed: list[str]
    onset: Any
    causes: list[_Cause]
    levels: _Levels


@dataclass(frozen=True)
class Options:
    """The log, the plant or its monitor, and where the results go."""

    log: Annotated[Path, "folder with log.json (docs/reference/files.md)"]
    _: KW_ONLY
    model: Annotated[Path | None, f"{MODEL} of an earlier call; default: of --plant"] = None
    gap: Annotated[Path | None, "gap.json of the same log: do both agree, or why not"] = None
    false_alarms: Annotated[float, Number(float, 1e-6, 100.0), "per hour of operation"] = 0.01
    out: Folder = Path("runs/monitor")
    plant: Annotated[
        PlantFile, "plant file of the identified valve; default: the report's calibration"
    ] = None
    seed: Annotated[Seed, "of the simulation"] = 0


def run(options: Options) -> None:
    """Write the monitor and its picture, and say what it found. Raises ValueError."""
    plant = load_plant(options.plant)
    log = read_log(options.log, rules_of(plant))
    log.check_period(Monitor.period, "the monitor counts periods of")
    finding = options.gap and _diagnosis_of(log, options.gap)
    if options.plant and not options.model:
        model = monitor_model(plant, seed=options.seed)
    else:
        model = MonitorModel.load(options.model or SHIPPED)
    model.save(options.out / MODEL)
    monitor = Monitor(model, false_alarms_per_hour=options.false_alarms)
    ends = follow(monitor, log)
    save_figure(picture(monitor, ends), options.out / FIGURE)
    print(*sentences(monitor, log, ends), sep="\n")
    if finding:
        print(agreement(monitor, log, ends, finding))
    print(f"written: {options.out / FIGURE}")


def _diagnosis_of(log: Log, path: Path) -> _Finding:
    """A diagnosis of the log. Raises ValueError for another file, and for that of another log."""
    content = read_json(path, _Finding, version=FORMAT, remedy="diagnose the log")
    began = [onset for cause in content["causes"] for onset in cause["onset"].values()]
    drives = {str(file) for onset in began for file in onset.values()}
    if unknown := sorted(drives - {drive.file for drive in log.drives}):
        raise ValueError(f"{path} names {unknown[0]}, which the log does not have: diagnose this log")
    return content


def next_step(options: Options) -> NextStep:
    """Diagnose the log."""
    words = ("gap", options.log, "--logs", "--out", beside(options.out, "gap"))
    return NextStep("to find the cause and its size", words, options.plant)


def follow(monitor: Monitor, log: Log) -> list[float]:
    """Feed the drives in order; returns the time at each one's end [s]."""
    ends = []
    for drive in log.drives:
        pressures = [each / BAR for each in (drive.p1, drive.p2, drive.p3)]
        monitor.follow(np.column_stack([drive.coil, drive.U, *pressures, drive.I]))
        ends.append(monitor.time)
    return ends


def sentences(monitor: Monitor, log: Log, ends: Sequence[float]) -> list[str]:
    """What the monitor says at the end, a sentence for each change."""
    if not monitor.history:
        return ["No opening of the log can be used: the coil must have been on before, and p3 at p1."]
    found = [_sentence(change, log, ends) for change in monitor.changes]
    if not found:
        found = [f"Nothing has changed: probability {monitor.probability:.2g} that something has."]
    if monitor.restarts:
        found.append(f"Restarts because its state was not finite: {monitor.restarts}.")
    return found


def _sentence(change: Change, log: Log, ends: Sequence[float]) -> str:
    """When a change came, and what it is."""
    file, when = _began(change, log, ends)
    causes = [f"{name} {p:.2f}" for name, p in change.causes.items() if p >= LIKELY]
    parts = [f"{name} {p:.2f}" for name, p in change.components.items() if p >= LIKELY]
    what = "The latest change is gone" if causes[0].startswith(RETURN) else "Something has changed"
    return (
        f"{what} (probability {change.probability:.4g}), in {file} at {when:.0f} s. "
        f"Effects: {', '.join(causes)}. Components: {', '.join(parts)}."
    )


def _began(change: Change, log: Log, ends: Sequence[float]) -> tuple[str, float]:
    """File of the drive in which a change began, and when in it [s]."""
    number = min(int(np.searchsorted(ends, change.onset, side="right")), len(ends) - 1)
    return log.drives[number].file, change.onset - (ends[number - 1] if number else 0.0)


def agreement(monitor: Monitor, log: Log, ends: Sequence[float], content: _Finding) -> str:
    """What the diagnosis of the same log says otherwise, and why; content: of gap.json."""
    named = {name for effects in content["ambiguity_set"] for name in effects}
    changes = {next(iter(change.causes)): change for change in reversed(monitor.changes)}
    seen = changes.keys() - {RETURN}
    said = [f"names {name}, {_unseen(monitor, name, seen, content)}" for name in sorted(named - seen)]
    said += [
        f"does not name {'a change without a name' if name == UNKNOWN else name}, "
        f"{_unnamed(changes[name], name, named, content)}"
        for name in sorted(seen - named)
    ]
    files = [drive.file for drive in log.drives]
    for name in sorted(named & seen):
        own, other = _began(changes[name], log, ends)[0], _drive_with(name, content, files[0])
        if not files.index(other["earliest"]) <= files.index(own) <= files.index(other["latest"]):
            said.append(
                f"has {name} begin in {other['drive']}, not {own}: it weighs whole drives, not openings"
            )
    if not said:
        return f"The diagnosis agrees: {content['verdict']}."
    return f"The diagnosis ({content['verdict']}) {'; it '.join(said)}."


def _unseen(monitor: Monitor, name: str, seen: Collection[str], content: _Finding) -> str:
    """Why the monitor has not told an effect."""
    hidden = any(f"{name} (p2)" in label for label in content["levels"]["form"])
    if name not in monitor.model.effects or hidden:
        return "which hardly shows in the features of an opening, which the monitor reads"
    if not content["onset"]:
        return "which acts in all drives, and the monitor takes it for the valve's own offset"
    if seen:
        return "where the monitor names what looks alike: it knows effects of usual size only"
    return "for which the monitor needs more openings, or a larger effect, at the stated false alarms"


def _unnamed(change: Change, name: str, named: Collection[str], content: _Finding) -> str:
    """Why the diagnosis has not named what the monitor tells."""
    if change.onset < START:
        return "by which the valve differs from the start on: there the four parameters are refitted"
    if name in {label.split(" ")[0] for label in content["absorbed"]}:
        return "which recalibration or the unknown consumption absorbs"
    if named:
        return "which looks like what it names: it simulates every effect and its law"
    return "since it allows for a misfit that no model is free of; the monitor compares openings alone"


def _drive_with(name: str, content: _Finding, first: str) -> _Began:
    """The first drive with an effect, according to gap.json; first: file of the log's first drive."""
    onsets = [o for c in content["causes"] for o in c["onset"].items() if name in c["effects"]]
    throughout = _Began(drive=first, earliest=first, latest=first)
    return next((own for label, own in onsets if label.split(" ")[0] == name), throughout)


def picture(monitor: Monitor, ends: list[float]) -> Figure:
    """The statistic over time; lines where drives end."""
    figure, axes = plt.subplots(figsize=(8, 3.5))
    if monitor.history:
        time, log_odds = np.array(monitor.history).T
        axes.plot(time, log_odds / np.log(10.0), ".-")
    axes.axhline(0.0, color="tab:red", label="alarm")
    for end in ends:
        axes.axvline(end, color="0.8")
    axes.set(xlabel="time of operation [s]", ylabel="log10 of the odds of a change [-]")
    axes.legend()
    return figure
