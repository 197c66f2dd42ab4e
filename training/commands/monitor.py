"""Follow the operation log of a valve with a monitor: has it changed, when, and what.

    epv monitor logs/valve-00 --out runs/monitor
    epv monitor logs/valve-01 --plant runs/plant.json --out runs/monitor
    epv monitor logs/valve-02 --model runs/monitor/monitor.json

What the monitor knows of the report's valve is shipped. Another plant is simulated first, with every
effect of the catalogue: a minute or two, once.
"""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from epv_env.common.command_line import NextStep, beside
from epv_env.common.options import Folder, Number, PlantFile, Seed
from epv_env.common.units import BAR
from epv_env.plant.plantfile import load_plant
from identification.monitor.model import RETURN, SHIPPED, MonitorModel
from identification.monitor.monitor import Change, Monitor
from identification.recordings.log_files import Log, read_log
from identification.recordings.recording import rules_of
from training.evaluation.plots import save_figure
from training.monitoring import monitor_model

MODEL, FIGURE = "monitor.json", "monitor.png"
"""What is written."""
LIKELY = 0.05
"""Probability from which a cause is named."""


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
    """Write the monitor and its picture, and say what it found. Raises ValueError."""
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
    save_figure(picture(monitor, ends), options.out / FIGURE)
    print(*sentences(monitor, log, ends), sep="\n")
    print(f"written: {options.out / FIGURE}")


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
