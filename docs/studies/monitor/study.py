"""How soon the monitor finds a change, how often it is right, and how often it is wrong.

    python -m docs.studies.monitor.study

drives valves of the report's plant with two controllers: ones in which an effect begins and ends, by
the fitted law or by one that deviates, and unchanged ones for hours, whose logs are clean or soiled.
results.jsonl keeps each run, README.md the tables.
"""

import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from controllers.base import Controller
from controllers.policy import load_policy
from controllers.tuned import tuned
from docs.studies.common import PAGE, fill, study_options, study_parser, table
from docs.studies.logs.study import deviate
from epv_env.common.command_line import fail_clearly
from epv_env.common.files import Journal, digest, read_bytes, write_bytes
from epv_env.plant.effects.coil import COPPER
from epv_env.plant.effects.record import Size
from epv_env.plant.effects.registry import EFFECTS
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import load_plant
from epv_env.plant.supply import Supply
from epv_env.plant.valves import Valves
from identification.monitor.model import RETURN, SHIPPED, MonitorModel
from identification.monitor.monitor import CONFIRMED, Monitor
from training.drives import DRIVE, drives
from training.evaluation.batches import run_jobs

FOLDER = Path(__file__).parent
SEED = 4977
"""Of valves, effects, consumption and voltage; the monitor is made with another."""
KINDS = HYSTERESIS, POLICY = "hysteresis", "policy"
"""Of controllers."""
LAWS = FITTED, DEVIATING = "fitted law", "law that deviates"
DEVIATIONS = (0.2, 0.5)
"""Range of the deviation of a law [-]."""
VALVES, PART = 6, 4
"""Valves with each effect, and their drives without it, with it, and after it is mended, each."""
UNCHANGED, DRIVES = 100, 20
"""Unchanged valves of a run, and drives of each: 17 hours."""
LEAST, MOST = 1.0, 2.0
"""Sizes of an effect, as multiples of the catalogue's trial size."""
VOLTAGES = (0.92, 1.08)
"""Range of the supply voltage in each drive, as shares of the plant's."""
HIDDEN = (
    "pressure dependent discharge", "flow force", "local gas speed (a1)", "local gas speed (a2)",
    "seat leak", "circuit leak", "pressure sensor bias (p2)", "pressure sensor gain (p2)",
    "coil heating",
)  # fmt: skip
"""Effects that an opening cannot show (docs/explanation/diagnosis.md, 9), or that are a condition."""

CLEAN, MISSING, SUPPLY, WARM = "clean", "rows missing, restarts", "another supply", "warm coil"
RUNS = {CLEAN: 9, MISSING: 3, SUPPLY: 3, WARM: 3}
"""Runs of unchanged valves with each controller, by what soils their logs: 300 h clean, 300 h soiled."""
GAP_EVERY, LONGEST_GAP = 2000, 400
"""Periods between gaps on average, and rows that a gap lacks at most: 10 s, and 2 s."""
LOST = 1 / 3000
"""Share of rows that are lost one by one, without a sign."""
SUPPLIES = (9.5, 13.0)
"""Range of a constant supply in place of the bench's reservoirs, anew for each drive [bar]."""
WARMEST, WARMING = 40.0, 4.0
"""Most that a winding is warmer than identified, and its change from drive to drive [K]."""


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

    def drive(
        self,
        parameters: Sequence[Parameters],
        *,
        begun: Callable[[Valves], object] = lambda valves: None,
        supply: bool = False,
        missing: bool = False,
    ) -> None:
        """One drive of every valve with these parameters.

        begun: of `drives`. supply: another one. missing: rows of what the monitors read.
        """
        seeds = self.rng.integers(2**32, size=len(self.monitors)).tolist()
        chosen: dict[str, Any] = {"parameters": list(parameters)}
        if supply:
            bars = self.rng.uniform(*SUPPLIES, size=len(seeds)).tolist()
            chosen["supply"] = [Supply.constant(bar) for bar in bars]
        voltage = self.rng.uniform(*VOLTAGES)
        readings = drives(self.plant, self.controller, seeds, chosen, voltage=voltage, begun=begun)
        for monitor, drive in zip(self.monitors, readings, strict=True):
            for part in soiled(drive, self.rng) if missing else (drive,):
                monitor.follow(part)


def soiled(drive: NDArray, rng: np.random.Generator) -> Iterator[NDArray]:
    """What is left of a drive (periods, 6): parts between gaps, without rows that are lost."""
    places = np.sort(rng.integers(len(drive), size=rng.poisson(len(drive) / GAP_EVERY)))
    first = 0
    for place in (*places, len(drive)):
        part = drive[first:place]
        yield part[rng.random(len(part)) >= LOST]
        first = place + int(rng.integers(1, LONGEST_GAP))


def alarms_of(monitor: Monitor) -> int:
    """How often an alarm began: the statistic has passed the threshold, and still does."""
    over = [log_odds > 0.0 for _, log_odds in monitor.history]
    alarms = [all(over[end - CONFIRMED : end]) for end in range(CONFIRMED, len(over) + 1)]
    return int(np.sum(np.diff(np.array(alarms, dtype=int), prepend=0) > 0))


def false_alarms(
    model: MonitorModel, kind: str, soil: str, number: int, valves: int, count: int
) -> dict[str, Any]:
    """Alarms of unchanged valves in `count` drives of each; soil: a key of RUNS."""
    fleet = Fleet(model, kind, valves, [SEED, number, list(RUNS).index(soil), 2])
    warm = np.zeros(valves)
    for _ in range(count):
        parameters = fleet.parameters
        if soil == WARM:
            warm = np.clip(warm + fleet.rng.normal(0.0, WARMING, size=valves), 0.0, WARMEST)
            parameters = [
                p.replace(R=p["R"] * (1.0 + COPPER * rise))
                for p, rise in zip(parameters, warm.tolist(), strict=True)
            ]
        fleet.drive(parameters, supply=soil == SUPPLY, missing=soil == MISSING)
    alarms = sum(alarms_of(monitor) for monitor in fleet.monitors)
    causes = [next(iter(c.causes)) for monitor in fleet.monitors for c in monitor.changes]
    return {"hours": count * valves * DRIVE / 3600.0, "alarms": alarms, "causes": causes}


def detection(
    model: MonitorModel, kind: str, law: str, valves: int, part: int
) -> dict[str, dict[str, list[float] | list[bool]]]:
    """By effect, each valve's answers after it has begun with a random size, and after it is mended."""
    begun = [(name, effect, row) for name, effect, row in labels() for _ in range(valves)]
    fleet = Fleet(model, kind, len(begun), [SEED, 1])
    for _ in range(part):
        fleet.drive(fleet.parameters)
    early = [len(monitor.changes) for monitor in fleet.monitors]
    changed = [
        parameters.replace(**sizes(row, fleet.rng))
        for parameters, (_, _, row) in zip(fleet.parameters, begun, strict=True)
    ]
    drawn = fleet.rng.uniform(*DEVIATIONS, size=len(begun))
    own_law = partial(deviate, deviations=drawn.tolist()) if law == DEVIATING else lambda valves: None
    for _ in range(part):
        fleet.drive(changed, begun=own_law)
    first = [m.changes[n:][:1] for m, n in zip(fleet.monitors, early, strict=True)]
    seen = [len(monitor.changes) for monitor in fleet.monitors]
    for _ in range(part):
        fleet.drive(fleet.parameters)
    later = [m.changes[n:] for m, n in zip(fleet.monitors, seen, strict=True)]
    answers: dict[str, dict[str, list]] = {
        name: {"found": [], "right": [], "late_s": [], "returned": []} for name, *_ in begun
    }
    for (name, effect, _), n, change, changes in zip(begun, early, first, later, strict=True):
        own = answers[name]
        own["found"].append(bool(change) and not n)
        own["right"].append(bool(change) and next(iter(change[0].causes)) == effect)
        own["late_s"].append(round(change[0].onset - part * DRIVE, 2) if change else 0.0)
        own["returned"].append(any(next(iter(c.causes)) == RETURN for c in changes))
    return answers


def labels() -> Iterator[tuple[str, str, Sequence[Size]]]:
    """Of each effect and variant: its name for people, the effect, and its sizes."""
    for effect in EFFECTS:
        for variant, row in effect.fitted.items():
            yield f"{effect.name} ({variant})".removesuffix(" ()").replace("_", " "), effect.name, row


def sizes(row: Sequence[Size], rng: np.random.Generator) -> dict[str, float]:
    """Its first trials times a random factor."""
    factor = rng.uniform(LEAST, MOST)
    return {
        size.symbol: min(size.trials[0] * factor, (size.domain or (0.0, np.inf))[1])
        for size in row
        if size.trials
    }


def effect_rows(journal: Journal) -> list[list[str]]:
    """Of each effect that an opening can show and that is missed in some valve, and of all of them."""
    answers = [journal[f"changes, {kind}, {law}"] for kind in KINDS for law in LAWS]
    names = [name for name, *_ in labels() if name not in HIDDEN]
    groups = {name: [name] for name in names if not all(all(a[name]["found"]) for a in answers)}
    groups["**all that an opening can show**"] = names
    return [
        [title, *(told([answer[name] for name in own]) for answer in answers)]
        for title, own in groups.items()
    ]


def told(results: Sequence[dict[str, Any]]) -> str:
    """Found; of these, named rightly, and told as returned; median distance of the onset."""
    found, right, late, returned = (
        np.concatenate([result[key] for result in results])
        for key in ("found", "right", "late_s", "returned")
    )
    found = found.astype(bool)
    if not found.any():
        return f"0/{len(found)}"
    error = np.median(np.abs(late[found]))
    named, back = int(right[found].sum()), int(returned[found].sum())
    return f"{found.sum()}/{len(found)}; {named}; {back}; {error:.1f}"


def alarm_rows(journal: Journal, runs: dict[str, int]) -> list[list[str]]:
    """Of each kind of log and controller: hours, false alarms, the 95 % bound, and causes."""
    rows = []
    for soil, count in runs.items():
        for kind in KINDS:
            own = [journal[f"unchanged {number}, {soil}, {kind}"] for number in range(count)]
            rows.append([soil, kind, *alarm_cells(own)])
    return rows


def alarm_cells(own: Sequence[dict[str, Any]]) -> list[str]:
    """Hours, alarms, the upper end of the exact 95 % interval of their rate, and the usual causes."""
    hours, alarms = (sum(each[key] for each in own) for key in ("hours", "alarms"))
    counts = Counter(cause for each in own for cause in each["causes"])
    named = ", ".join(f"{cause.replace('_', ' ')} {n}" for cause, n in counts.most_common(3))
    return [f"{hours:.1f}", str(alarms), f"{chi2.ppf(0.95, 2 * alarms + 2) / 2 / hours:.3f}", named]


def tasks(
    model: MonitorModel, runs: dict[str, int], changed: tuple[int, int], unchanged: tuple[int, int]
) -> dict[str, Callable[[], dict[str, Any]]]:
    """What to measure, by name in the journal; valves and drives of changed and of unchanged ones."""
    found: dict[str, Callable[[], dict[str, Any]]] = {}
    for law in LAWS:
        for kind in KINDS:
            found[f"changes, {kind}, {law}"] = partial(detection, model, kind, law, *changed)
    for kind, number in product(KINDS, range(max(runs.values()))):
        for soil in (soil for soil, own in runs.items() if number < own):
            name = f"unchanged {number}, {soil}, {kind}"
            found[name] = partial(false_alarms, model, kind, soil, number, *unchanged)
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    options = study_options(study_parser(__doc__ or "", FOLDER), arguments)
    runs = dict.fromkeys(RUNS, 1) if options.quick else RUNS
    changed, unchanged = ((1, 1), (8, 1)) if options.quick else ((VALVES, PART), (UNCHANGED, DRIVES))
    model = digest(read_bytes(SHIPPED))
    subject = {"model": model, "seed": SEED, "changed": changed, "unchanged": unchanged}
    journal = Journal(options.work / "results.jsonl", subject)
    jobs = tasks(MonitorModel.load(SHIPPED), runs, changed, unchanged)
    run_jobs(jobs, journal=journal, workers=None, what="monitor")
    report(journal, runs, options.out / PAGE)
    write_bytes(options.out / journal.path.name, read_bytes(journal.path))
    return 0


def report(journal: Journal, runs: dict[str, int], page: Path) -> None:
    """Write the page's tables."""
    kinds = [f"{kind}, {law}" for kind in KINDS for law in LAWS]
    alarms = ["log", "controller", "hours", "false alarms", "95 % bound [1/h]", "named"]
    parts = {
        "effects": table(["effect", *kinds], effect_rows(journal)),
        "alarms": table(alarms, alarm_rows(journal, runs)),
    }
    fill(page, parts)


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
