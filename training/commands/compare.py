"""Compare controllers on the same unseen episodes, with intervals of the differences.

    python training/compare.py --out runs/comparison
    python training/compare.py --controllers "pulse, adaptive" PPO=runs/ppo --out runs/mine
    python training/compare.py --scenarios beyond worn --plants sensitive_ten_percent --out runs/beyond

A comparison that was stopped goes on where it stopped when it is started again.
"""

import argparse
from typing import Any

import numpy as np
import pandas as pd

from controllers.tuned import load_tunings
from epv_env.common.command_line import COUNT, NextStep, add_episodes, add_out, beside, plant_option
from epv_env.common.files import Journal, write_json, write_text
from epv_env.plant.plantfile import load_plant, plant_subject
from epv_env.plant.valves import available_cores
from epv_env.vector_entry import check_device
from training.evaluation.named import HELP, named_controllers
from training.evaluation.plots import save_figure
from training.evaluation.rollout import decision_times
from training.evaluation.scenarios import RANDOM, scenario_group
from training.evaluation.seeds import EVALUATION_SEED, check_first_seed
from training.studies.comparison import (
    PLANTS,
    Results,
    as_text,
    compare,
    differences,
    figure,
    rows,
)

QUICK: dict[str, Any] = {"episodes": 8, "duration": 0.8, "decisions": 20}
LISTED = 100
"""Episodes that leave the band are named by their seeds up to this many."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_out(parser, "runs/comparison")
    parser.add_argument(
        "--controllers", nargs="+", metavar="NAME", default=list(load_tunings()),
        help=f"{HELP} (default: all tuned kinds)",
    )  # fmt: skip
    parser.add_argument("--against", metavar="LABEL", help="whom the others are set against (the first)")
    parser.add_argument("--plants", nargs="+", choices=list(PLANTS), default=list(PLANTS))
    parser.add_argument(
        "--scenarios", nargs="+", metavar="NAME", default=[RANDOM],
        help="scenarios, or the groups named, beyond (beyond training), worn (one effect each)",
    )  # fmt: skip
    parser.add_argument("--episodes", type=COUNT, default=1024, help="in each scenario and plant set")
    parser.add_argument("--decisions", type=COUNT, default=1000, help="whose time is measured")
    add_episodes(parser)


def run(options: argparse.Namespace) -> None:
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
        workers=options.workers or available_cores(), digests=digests, device=options.device,
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


def next_step(options: argparse.Namespace) -> NextStep:
    """Sweep the same controllers."""
    words = ("--controllers", *options.controllers, "--out", beside(options.out, "sweep"))
    return NextStep(
        "to see which changes of the valve they bear", ("sweep", *words, *plant_option(options.plant))
    )


def write_results(
    options: argparse.Namespace,
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
