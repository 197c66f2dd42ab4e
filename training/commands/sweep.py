"""Robustness of controllers against plants, effects, sensors and timing that deviate.

    python training/sweep.py --out runs/sweep
    python training/sweep.py --out runs/friction --designs effects --factors piston_friction

A sweep that was stopped goes on where it stopped when it is started again.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import pandas as pd

from controllers.policy_files import holds_policy
from epv_env.common.command_line import NextStep, beside
from epv_env.common.files import Journal, write_json, write_text
from epv_env.common.options import Count, Episodes, Folder, Names, Quick
from epv_env.plant.consumption import check_scenario
from epv_env.plant.plantfile import load_plant, plant_subject
from epv_env.vector_entry import check_device
from training.evaluation.batches import Batch, run_batches
from training.evaluation.named import HELP, named_controllers
from training.evaluation.seeds import SWEEP_SEED, check_first_seed
from training.studies.sweep import (
    DESIGNS,
    chosen_points,
    harmful_changes,
    point_table,
    region_table,
)

DEFAULT = ("extrapolating hysteresis", "adaptive pulse", "PWM")
"""Controllers that are swept unless others are named: one of each kind."""

QUICK: dict[str, Any] = {
    "out": Path("runs/quick-sweep"), "controllers": DEFAULT[:1], "episodes": 4,
    "joint_episodes": 16, "duration": 0.6,
    "factors": ["R", "V2", "piston_friction", "sensor noise", "control period", "latency"],
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Options(Episodes):
    """Controllers, what changes, and how many episodes at each change."""

    out: Folder = Path("runs/sweep")
    controllers: Annotated[Names, HELP] = DEFAULT
    designs: Annotated[Sequence[str], {"nargs": "+", "choices": DESIGNS}, "what changes"] = DESIGNS
    factors: Annotated[
        Sequence[str], {"nargs": "+"}, "change only these, one at a time (default: all)"
    ] = ()
    episodes: Annotated[Count, "at each point that changes one thing"] = 128
    joint_episodes: Annotated[Count, "at each region"] = 4096
    scenario: Annotated[str, "consumption, where it is not what changes"] = "mixed"
    quick: Quick = False


def run(options: Options) -> None:
    """Run the episodes that --out lacks; write and print tables.

    Raises ValueError for an unknown controller, scenario or factor.
    """
    check_first_seed(options.seed, max(options.episodes, options.joint_episodes))
    check_scenario(options.scenario)
    check_device(options.device)
    plant = load_plant(options.plant)
    controllers, digests = named_controllers(options.controllers, plant)
    points = chosen_points(plant, options.designs, options.factors)
    cells = [(point, label) for point in points for label in controllers]
    about = {**plant_subject(plant), "scenario": options.scenario, "duration": options.duration}
    batches = [
        Batch(
            name=f"{point.design}, {point.factor}, {point.level}, {label} {digests[label]}",
            controller=label,
            first_seed=SWEEP_SEED + options.seed,
            episodes=options.joint_episodes if point.design == "regions" else options.episodes,
            duration=options.duration,
            device=options.device,
            options={"plant": plant, "scenario": options.scenario, **point.options},
        )
        for point, label in cells
    ]
    metrics = run_batches(
        batches, controllers, journal=Journal(options.out / "finished.jsonl", about),
        workers=options.workers, what="sweep",
    )  # fmt: skip
    table = point_table(cells, metrics, SWEEP_SEED + options.seed)
    write_results(options, table, {**about, "controllers": digests})
    print(f"\nresults in {options.out}")


def next_step(options: Options) -> NextStep:
    """Export the policy that was swept; train one if none was."""
    folders = [Path(source.rpartition("=")[2]) for source in options.controllers]
    if policy := next(filter(holds_policy, folders), None):
        words = ("export", policy, "--out", beside(options.out, "c"))
        return NextStep("to turn the policy into C", words, options.plant)
    words = ("train", "--out", beside(options.out, "policy"))
    return NextStep("to train a policy beside these controllers", words, options.plant)


def write_results(options: Options, points: pd.DataFrame, settings: dict[str, Any]) -> None:
    """Write points.csv and results.json; print the tables."""
    write_text(options.out / "points.csv", points.to_csv(index=False))
    content = {"format": "epv-sweep/3", "settings": settings, "points": points.to_dict("records")}
    write_json(options.out / "results.json", content)
    texts = (region_table(points), harmful_changes(points))
    print("\n\n".join(text.to_string(index=False) for text in texts if len(text)))
