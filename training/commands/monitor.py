"""Follow the operation log of a valve with a monitor: has it changed, when, and what.

    epv monitor logs/valve-00 --out runs/monitor
    epv monitor logs/valve-01 --plant runs/plant.json --out runs/monitor
    epv monitor logs/valve-02 --model runs/monitor/monitor.json

What the monitor knows of the report's valve is shipped. Another plant is simulated first, with every
effect of the catalogue: a minute or two, once.
"""

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from matplotlib.figure import Figure
from scipy.special import expit

from epv_env.common.command_line import NextStep, beside
from epv_env.common.options import Folder, Number, PlantFile, Seed
from epv_env.common.units import BAR
from epv_env.plant.plantfile import load_plant
from identification.gap.report.sentences import probability_text
from identification.monitor.model import RETURN, SHIPPED, UNKNOWN, MonitorModel
from identification.monitor.monitor import SETTLING, Change, Monitor
from identification.recordings.log_files import Log, read_log
from identification.recordings.recording import rules_of
from identification.report.page import Picture, Section, Verdict, write_page
from training.monitoring import monitor_model

MODEL, PAGE = "monitor.json", "report.html"
"""What is written."""
LIKELY, SURE = 0.05, 0.5
"""Probabilities from which a cause is named, and from which its name is not in doubt."""
NAMED_DRIVES = 12
"""Most drives that the picture names."""
WORDS = {UNKNOWN: "something outside the catalogue", RETURN: "the latest change is gone"}


@dataclass(frozen=True)
class Options:
    """The log, the plant or its monitor, and where the results go."""

    log: Annotated[Path, "folder with log.json (docs/reference/files.md)"]
    _: KW_ONLY
    model: Annotated[Path | None, f"{MODEL} of an earlier call; default: of --plant"] = None
    false_alarms: Annotated[float, Number(float, 1e-6, 100.0), "per hour of operation"] = 0.01
    out: Folder = Path("runs/monitor")
    plant: Annotated[
        PlantFile, "plant file of the identified valve; default: the report's calibration"
    ] = None
    seed: Annotated[Seed, "of the simulation"] = 0


def run(options: Options) -> None:
    """Write the monitor and its page, and say what it found. Raises ValueError."""
    plant = load_plant(options.plant)
    log = read_log(options.log, rules_of(plant))
    log.check_period(Monitor.period, "the monitor counts periods of")
    if options.plant and not options.model:
        model = monitor_model(plant, seed=options.seed)
    else:
        model = MonitorModel.load(options.model or SHIPPED)
    model.save(options.out / MODEL)
    monitor = Monitor(model, false_alarms_per_hour=options.false_alarms)
    ends = follow(monitor, log)
    found = verdicts(monitor, log, ends)
    verdict = Section(title="Verdict", summary=True, verdicts=found, blocks=pictures(monitor, log, ends))
    write_page(
        options.out / PAGE,
        title=f"Has the valve changed: {log.name}",
        sections=[verdict],
        facts={
            "Log": log.name,
            "Operation": f"{len(ends)} drives, {monitor.time / 60:.3g} min",
            "Alarms": f"{options.false_alarms:g} false ones an hour are accepted",
        },
        next_step=next_step(options),
    )
    print(*(verdict.text for verdict in found), sep="\n")
    print(f"written: {options.out / PAGE}")


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


def verdicts(monitor: Monitor, log: Log, ends: Sequence[float]) -> list[Verdict]:
    """What the monitor says at the end, a sentence or two for each change."""
    if not monitor.history:
        text = "No opening of the log can be used: the coil must have been on before, and p3 at p1."
        return [Verdict(status="doubt", text=text)]
    found = [_verdict(change, log, ends) for change in monitor.changes]
    if not found:
        chance = probability_text(monitor.probability)
        text = f"The valve is as it was identified: the probability of a change is {chance}."
        found = [Verdict(status="good", text=text)]
    elif not monitor.alarm:
        text = f"The probability of a further change is {probability_text(monitor.probability)}."
        found.append(Verdict(status="note", text=text))
    if monitor.restarts:
        text = f"Restarts because its state was not finite: {monitor.restarts}."
        found.append(Verdict(status="doubt", text=text))
    return found


def _verdict(change: Change, log: Log, ends: Sequence[float]) -> Verdict:
    """Since when, how sure, and what it is."""
    since, sure = _since(change, log, ends), probability_text(change.probability)
    first, chance = next(iter(change.causes.items()))
    if first == RETURN:
        text = f"The latest change is gone, {since} ({sure}): repaired, or the supply is back."
        return Verdict(status="note", text=text)
    text = (
        f"The valve has changed, {since} ({sure}). The cause is {_likely(change.causes)}; "
        f"the part is {_likely(change.components)}."
    )
    doubtful = first == UNKNOWN or chance < SURE
    return Verdict(status="doubt" if doubtful else "note", text=text)


def _likely(chances: Mapping[str, float]) -> str:
    """Names with their probabilities, the likeliest first."""
    likely = [(name, chance) for name, chance in chances.items() if chance >= LIKELY]
    return " or ".join(f"{_plain(name)} ({probability_text(chance)})" for name, chance in likely)


def _plain(name: str) -> str:
    return WORDS.get(name, name.replace("_", " "))


def _since(change: Change, log: Log, ends: Sequence[float]) -> str:
    """The drive in which a change began, and when in it."""
    if change.onset <= 0.0:
        return "before the log began"
    number = min(int(np.searchsorted(ends, change.onset, side="right")), len(ends) - 1)
    when = change.onset - (ends[number - 1] if number else 0.0)
    return f"since {log.drives[number].file}, {when:.0f} s after its start"


def pictures(monitor: Monitor, log: Log, ends: Sequence[float]) -> list[Picture]:
    """The probability of a change over the drives, and where changes began."""
    if not monitor.history:
        return []
    figure = Figure(figsize=(7.0, 3.4), layout="constrained")
    axes = figure.subplots()
    edges = np.array([0.0, *ends])
    for begin, end in zip(edges[1:-1:2], edges[2::2], strict=True):
        axes.axvspan(begin, end, color="0.94")
    time, log_odds = np.array(monitor.history).T
    axes.step(time, 100.0 * expit(log_odds), where="post", color="tab:blue")
    for change in monitor.changes:
        axes.axvline(change.onset, color="tab:red")
        words = f" {_plain(next(iter(change.causes)))}"
        axes.text(change.onset, 103.0, words, color="tab:red", va="bottom", rotation=15)
    named = range(0, len(ends), -(-len(ends) // NAMED_DRIVES))
    names = [Path(log.drives[k].file).stem for k in named]
    axes.set_xticks([(edges[k] + edges[k + 1]) / 2 for k in named], names, rotation=30, ha="right")
    axes.axhline(50.0, color="0.4", linewidth=0.8, linestyle="--")
    axes.set(xlim=(0.0, ends[-1]), ylim=(0.0, 102.0))
    axes.set_ylabel("probability that the\nvalve has changed [%]")
    caption = (
        "Probability that the valve has changed, over the drives; red: when a change began. Two "
        "openings in a row above the dashed line are an alarm. Once it has lasted for "
        f"{SETTLING} openings, the changed valve becomes the reference, and the probability falls to 0; "
        "a later rise is that of a further change."
    )
    return [Picture(figure=figure, caption=caption)]
