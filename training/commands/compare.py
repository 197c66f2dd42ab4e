"""Compare controllers on the same unseen episodes, with intervals of the differences.

    python training/compare.py --out runs/comparison
    python training/compare.py --controllers "adaptive pulse" PPO=runs/ppo --out runs/mine
    python training/compare.py --scenarios beyond worn --plants sensitive_ten_percent --out runs/beyond

A comparison that was stopped goes on where it stopped when it is started again.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd

from controllers.tuned import load_tunings
from epv_env.common.command_line import NextStep, beside
from epv_env.common.files import Journal, write_json, write_text
from epv_env.common.options import Count, Episodes, Folder, Names, Quick
from epv_env.plant.plantfile import load_plant, plant_subject
from epv_env.vector_entry import check_device
from training.evaluation.named import HELP, named_controllers
from training.evaluation.plots import save_figure
from training.evaluation.rollout import decision_times
from training.evaluation.scenarios import RANDOM, scenario_group
from training.evaluation.seeds import EVALUATION_SEED, check_first_seed
from training.studies.comparison import (
    PLANT_SETS,
    PLANTS,
    Results,
    as_text,
    compare,
    differences,
    figure,
    rows,
)

QUICK: dict[str, Any] = {
    "out": Path("runs/quick-comparison"), "episodes": 8, "duration": 0.8, "decisions": 20,
}  # fmt: skip
LISTED = 100
"""Episodes that leave the band are named by their seeds up to this many."""


@dataclass(frozen=True, kw_only=True)
class Options(Episodes):
    """Controllers, plants and scenarios, and how many episodes of each."""

    out: Folder = Path("runs/comparison")
    controllers: Annotated[Names, f"{HELP} (default: all tuned kinds)"] = tuple(load_tunings())
    against: Annotated[
        str | None, {"metavar": "LABEL"}, "whom the others are set against (the first)"
    ] = None
    plants: Annotated[Sequence[str], {"nargs": "+", "choices": PLANT_SETS}, "sets of plants"] = PLANTS
    scenarios: Annotated[Names, "scenarios, or the groups named, beyond, faults, worn"] = (RANDOM,)
    episodes: Annotated[Count, "in each scenario and plant set"] = 1024
    decisions: Annotated[Count, "whose time is measured"] = 1000
    quick: Quick = False


def run(options: Options) -> None:
    """Run the episodes that --out lacks; write tables, differences and pictures.

    Raises ValueError for an unknown controller or scenario.
    """
    check_first_seed(options.seed, options.episodes)
    check_device(options.device)
    plant = load_plant(options.plant)
    controllers, digests = named_controllers(options.controllers, plant)
    against = options.against or next(iter(controllers))
    if against not in controllers:
        raise ValueError(f"--against {against!r} takes no part: give one of {', '.join(controllers)}")
    scenarios = {k: v for name in options.scenarios for k, v in scenario_group(name).items()}
    first_seed = EVALUATION_SEED + options.seed
    described = {name: repr(scenario) for name, scenario in scenarios.items()}
    about = {**plant_subject(plant), "duration": options.duration, "scenarios": described}
    results = compare(
        controllers, plant=plant, scenarios=scenarios, episodes=options.episodes,
        duration=options.duration, plant_sets=options.plants, first_seed=first_seed,
        workers=options.workers, digests=digests, device=options.device,
        journal=Journal(options.out / "finished.jsonl", about),
    )  # fmt: skip
    times = {
        label: 1e6 * np.median(decision_times(each, options.decisions, plant=plant, scenario="steps"))
        for label, each in controllers.items()
    }
    table: Any = rows(results).assign(decision_us=lambda row: row["controller"].map(times))
    paired = differences(results, against)
    settings = {name: getattr(options, name) for name in ("episodes", "duration", "seed", "plants")}
    write_results(options, table, paired, results, first_seed, {**settings, "controllers": digests})
    shown = table[(table["plants"] == options.plants[-1]) & (table["scenario"] == next(iter(scenarios)))]
    save_figure(figure(shown), options.out / "comparison.png")
    for _, cell in table.groupby(["plants", "scenario"], sort=False):
        print(f"{as_text(cell)}\n")
    print(f"results in {options.out}")


def next_step(options: Options) -> NextStep:
    """Sweep the same controllers."""
    words = ("sweep", "--controllers", *options.controllers, "--out", beside(options.out, "sweep"))
    return NextStep("to see which changes of the valve they bear", words, options.plant)


def write_results(
    options: Options,
    table: pd.DataFrame,
    paired: pd.DataFrame,
    results: Results,
    first_seed: int,
    settings: dict[str, Any],
) -> None:
    """Write comparison.csv, differences.csv and results.json (with the seeds of episodes that left)."""
    write_text(options.out / "comparison.csv", table.to_csv(index=False))
    if len(paired):
        write_text(options.out / "differences.csv", paired.to_csv(index=False))
    left = [
        (first_seed + np.flatnonzero(~metrics.stayed)[:LISTED]).tolist() for metrics in results.values()
    ]
    write_json(
        options.out / "results.json",
        {
            "settings": settings,
            "rows": table.assign(left_seeds=left).to_dict("records"),
            "differences": paired.to_dict("records"),
        },
    )
