"""How soon the monitor finds a change, how often it is right, and how often it is wrong.

    python -m docs.studies.monitor.study

drives valves of the report's plant with two controllers: unchanged ones for hours, and ones in which an
effect begins. results.jsonl keeps each run, README.md the tables.
"""

import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from controllers.base import Controller
from controllers.monitor import RETURN, SHIPPED, Monitor, MonitorModel
from controllers.policy import load_policy
from controllers.tuned import tuned
from docs.studies.common import PAGE, fill, study_options, study_parser, table
from epv_env.common.command_line import fail_clearly
from epv_env.common.files import Journal
from epv_env.common.results_folder import progress
from epv_env.plant.effects.registry import EFFECTS
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import load_plant
from training.drives import DRIVE, drives

FOLDER = Path(__file__).parent
SEED = 4977
"""Of valves, effects, consumption and voltage; the monitor is made with another."""
KINDS = HYSTERESIS, POLICY = "hysteresis", "policy"
"""Of controllers."""
VALVES, BEFORE, AFTER = 6, 4, 4
"""Valves with each effect, and their drives without and with it."""
UNCHANGED, DRIVES, RUNS = 32, 20, 12
"""Unchanged valves of a run, drives of each, and runs with each controller: 64 hours."""
LEAST, MOST = 1.0, 2.0
"""Sizes of an effect, as multiples of the catalogue's trial size."""
VOLTAGES = (0.92, 1.08)
"""Range of the supply voltage in each drive, as shares of the plant's."""


class Fleet:
    """Valves that a controller drives, each with its monitor."""

    def __init__(self, model: MonitorModel, kind: str, valves: int, seed: Sequence[int]):
        """kind: of the controller. seed: of parameters, consumption and voltage."""
        self.plant, self.rng = load_plant(None), np.random.default_rng(seed)
        self.controller: Controller = (
            load_policy(plant=self.plant) if kind == POLICY else tuned(kind, self.plant)
        )
        self.parameters = [self.plant.region.draw(self.rng) for _ in range(valves)]
        self.monitors = [Monitor(model) for _ in range(valves)]

    def drive(self, parameters: Sequence[Parameters]) -> None:
        """One drive of every valve with these parameters."""
        seeds = self.rng.integers(2**32, size=len(self.monitors)).tolist()
        voltage = self.rng.uniform(*VOLTAGES)
        readings = drives(
            self.plant, self.controller, seeds, {"parameters": list(parameters)}, voltage=voltage
        )
        for monitor, drive in zip(self.monitors, readings, strict=True):
            monitor.follow(drive)


def alarms_of(monitor: Monitor) -> int:
    """How often the statistic has passed the threshold from below."""
    over = np.array([log_odds > 0.0 for _, log_odds in monitor.history])
    return int(np.sum(np.diff(over.astype(int), prepend=0) > 0))


def false_alarms(model: MonitorModel, kind: str, number: int, count: int) -> dict[str, Any]:
    """Alarms of unchanged valves in `count` drives of each."""
    fleet = Fleet(model, kind, UNCHANGED, [SEED, number, 0])
    for _ in range(count):
        fleet.drive(fleet.parameters)
    alarms = sum(alarms_of(monitor) for monitor in fleet.monitors)
    return {"hours": count * UNCHANGED * DRIVE / 3600.0, "alarms": alarms}


def detection(model: MonitorModel, kind: str, effect: Any, number: int) -> dict[str, Any]:
    """Each valve's answers after an effect of random size has begun, and after it is mended."""
    fleet = Fleet(model, kind, VALVES, [SEED, number, 1])
    for _ in range(BEFORE):
        fleet.drive(fleet.parameters)
    early = [len(monitor.changes) for monitor in fleet.monitors]
    changed = [parameters.replace(**sizes(effect, fleet.rng)) for parameters in fleet.parameters]
    for _ in range(AFTER):
        fleet.drive(changed)
    first = [m.changes[n:][:1] for m, n in zip(fleet.monitors, early, strict=True)]
    seen = [len(monitor.changes) for monitor in fleet.monitors]
    for _ in range(AFTER):
        fleet.drive(fleet.parameters)
    later = [m.changes[n:] for m, n in zip(fleet.monitors, seen, strict=True)]
    return {
        "found": [bool(change) and not n for change, n in zip(first, early, strict=True)],
        "right": [bool(c) and next(iter(c[0].causes)) == effect.name for c in first],
        "late_s": [round(c[0].onset - BEFORE * DRIVE, 2) if c else 0.0 for c in first],
        "returned": [any(next(iter(c.causes)) == RETURN for c in changes) for changes in later],
    }


def sizes(effect: Any, rng: np.random.Generator) -> dict[str, float]:
    """A variant of the effect, its first trial times a random factor."""
    variants = list(effect.fitted.values())
    factor = rng.uniform(LEAST, MOST)
    return {
        size.symbol: min(size.trials[0] * factor, (size.domain or (0.0, np.inf))[1])
        for size in variants[int(rng.integers(len(variants)))]
    }


def effect_rows(journal: Journal) -> list[list[str]]:
    """Of each effect and controller: valves found; cause and onset of these."""
    rows, every = [], {kind: [] for kind in KINDS}
    for effect in EFFECTS:
        row = [effect.name.replace("_", " ")]
        for kind in KINDS:
            result = journal[f"{effect.name}, {kind}"]
            every[kind].append(result)
            row += cells([result])
        rows.append(row)
    return [*rows, ["**all**", *(cell for kind in KINDS for cell in cells(every[kind]))]]


def cells(results: Sequence[dict[str, Any]]) -> list[str]:
    """Found; right cause of the found; median distance of the onset."""
    found, right, late = (
        np.concatenate([result[key] for result in results]) for key in ("found", "right", "late_s")
    )
    found = found.astype(bool)
    if not found.any():
        return [f"0 of {len(found)}", "", ""]
    error = np.median(np.abs(late[found]))
    return [f"{found.sum()} of {len(found)}", f"{right[found].sum()} of {found.sum()}", f"{error:.1f} s"]


def alarm_rows(journal: Journal, runs: int) -> list[list[str]]:
    """Of each controller: hours, false alarms, and the exact 95 % bound of their rate."""
    rows = []
    for kind in KINDS:
        own = [journal[f"unchanged {number}, {kind}"] for number in range(runs)]
        hours, alarms = (sum(each[key] for each in own) for key in ("hours", "alarms"))
        rows.append(
            [kind, f"{hours:.1f}", str(alarms), f"{chi2.ppf(0.95, 2 * alarms + 2) / 2 / hours:.3f}"]
        )
    return rows


def tasks(model: MonitorModel, runs: int, count: int) -> dict[str, Callable[[], dict[str, Any]]]:
    """What to measure, by name in the journal."""
    found: dict[str, Callable[[], dict[str, Any]]] = {}
    for kind in KINDS:
        for number in range(runs):
            found[f"unchanged {number}, {kind}"] = partial(false_alarms, model, kind, number, count)
        for number, effect in enumerate(EFFECTS):
            found[f"{effect.name}, {kind}"] = partial(detection, model, kind, effect, number)
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    options = study_options(study_parser(__doc__ or "", FOLDER), arguments)
    runs, count = (1, 1) if options.quick else (RUNS, DRIVES)
    subject = {"seed": SEED, "valves": VALVES, "quick": options.quick}
    journal = Journal(options.out / "results.jsonl", subject)
    missing = {
        name: task
        for name, task in tasks(MonitorModel.load(SHIPPED), runs, count).items()
        if name not in journal
    }
    for name in progress(missing, what="monitor"):
        journal.add(name, missing[name]())
    report(journal, runs, options.out / PAGE)
    return 0


def report(journal: Journal, runs: int, page: Path) -> None:
    """Write the page's tables."""
    kinds = [f"{kind}: {what}" for kind in KINDS for what in ("found", "right cause", "onset off by")]
    alarms = ["controller", "hours", "false alarms", "95 % bound [1/h]"]
    parts = {
        "effects": table(["effect", *kinds], effect_rows(journal)),
        "alarms": table(alarms, alarm_rows(journal, runs)),
    }
    fill(page, parts)


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
