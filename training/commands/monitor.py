"""Follow the operation log of a valve with a monitor: has it changed, when, and what.

    epv monitor logs/valve-01 --plant runs/plant.json --out runs/monitor
    epv monitor logs/valve-02 --model runs/monitor/monitor.json

Without --model the plant is simulated first, with every effect of the catalogue: a minute or two.
"""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from controllers.monitor import FEATURES, Monitor, MonitorModel
from epv_env.common.command_line import NextStep, beside
from epv_env.common.options import Folder, Number, PlantFile, Seed
from epv_env.common.units import BAR
from epv_env.plant.plantfile import load_plant
from identification.recordings.log_files import Log, read_log
from identification.recordings.rules import rules_of
from training.evaluation.plots import save_figure
from training.monitoring import monitor_model

MODEL, FIGURE = "monitor.json", "monitor.png"
"""What is written."""
VALVES = Number(int, 2 * len(FEATURES), 10_000)
"""With fewer, the scatter between valves is not known in all features: false alarms."""
LIKELY = 0.05
"""Probability from which a cause is named."""


@dataclass(frozen=True)
class Options:
    """The log, the plant or its monitor, and where the results go."""

    log: Annotated[Path, "folder with log.json (docs/reference/files.md)"]
    _: KW_ONLY
    model: Annotated[Path | None, f"{MODEL} of an earlier call; default: made anew"] = None
    false_alarms: Annotated[float, Number(float, 1e-6, 100.0), "per hour of operation"] = 0.01
    valves: Annotated[int, VALVES, "simulated valves of the plant"] = 48
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
    if options.model is None:
        model = monitor_model(plant, valves=options.valves, seed=options.seed)
        model.save(options.out / MODEL)
    else:
        model = MonitorModel.load(options.model)
    monitor = Monitor(model, false_alarms_per_hour=options.false_alarms)
    ends = follow(monitor, log)
    save_figure(picture(monitor, ends), options.out / FIGURE)
    print(sentence(monitor))
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


def sentence(monitor: Monitor) -> str:
    """What the monitor says at the end."""
    if not monitor.history:
        return "No opening of the log can be used: the coil must have been on before, and p3 at p1."
    count = monitor.restarts
    again = f" Restarts because its state was not finite: {count}." if count else ""
    if not monitor.alarm:
        return f"Nothing has changed: probability {monitor.probability:.2g} that something has.{again}"
    causes = [f"{name} {p:.2f}" for name, p in monitor.causes().items() if p >= LIKELY]
    parts = [f"{name} {p:.2f}" for name, p in monitor.components().items() if p >= LIKELY]
    return (
        f"Something has changed (probability {monitor.probability:.4g}), at {monitor.onset:.0f} s. "
        f"Effects: {', '.join(causes)}. Components: {', '.join(parts)}.{again}"
    )


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
