"""Regret of controllers: what each loses against a bound that knows plant and state, not the future.

    python training/regret.py --out runs/regret

docs/explanation/controllers.md explains the bound, docs/results/comparison.md holds the table.
"""

import training.console.missing_packages  # noqa: F401 - before what may be missing

# isort: split
import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from controllers.base import Controller
from controllers.causal_bound import CausalBound
from controllers.learned import TRAINED
from controllers.registry import SIMULATING_KINDS
from controllers.tuned import load_tunings
from epv_env.common.command_line import (
    check_positive,
    fail_clearly,
    parse_with_quick,
    writable_folder,
)
from epv_env.common.files import write_json
from epv_env.common.results_folder import only_writer
from epv_env.plant.consumption import MIXED
from epv_env.plant.plantfile import Plant
from epv_env.plant.valves import available_cores
from training.evaluation.metrics import EpisodeMetrics
from training.evaluation.scenarios import RANDOM, TUNING_REGION
from training.evaluation.seeds import EVALUATION_SEED, VALIDATION_SEED
from training.evaluation.statistics import paired_difference
from training.studies.comparison.episode_blocks import Block, block_results
from training.studies.episode_tasks import Study
from training.studies.fingerprint import fingerprint
from training.studies.generated_pages import markdown
from training.studies.named_controllers import HELP, INFORMED, SUPERVISED, named_controllers
from training.studies.parallel_run import task_runner
from training.studies.result_files import records

BLOCK = 8
"""Episodes of the bound that are run, and resumed, together."""
COST = 200
"""Computing time of an episode of the bound, in those of the others: for the progress bar."""

POLICIES = (
    f"PPO, end to end={TRAINED / 'end-to-end' / 'seed-0'}",
    f"PPO, recurrent={TRAINED / 'recurrent' / 'seed-7'}",
)
DEFAULT = (
    *(SUPERVISED + policy for policy in POLICIES), *POLICIES, f"PPO={TRAINED / 'plain' / 'seed-0'}",
    *(name for name in load_tunings() if name not in SIMULATING_KINDS), INFORMED,
)  # fmt: skip

QUICK: dict[str, Any] = {"episodes": 2, "duration": 0.6, "controllers": ["pulse"]}
"""The defaults under --quick: too few episodes to tell anything."""


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A figure whose regret is tabulated; all are worse the larger they are."""

    heading: str
    name: str
    """Of EpisodeMetrics."""
    factor: float
    """From the unit of the metric to the heading's; -1 for a return."""


FIGURES = (
    Figure(heading="return lost", name="episode_return", factor=-1.0),
    Figure(heading="rms error [mbar]", name="rms_bar", factor=1e3),
    Figure(heading="breakdown per event [mbar]", name="event_breakdown_bar", factor=1e3),
    Figure(heading="switchings [1/s]", name="switchings_per_s", factor=1.0),
)


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line's options, checked."""
    parser = argparse.ArgumentParser(description="Regret of controllers against the causal bound.")
    parser.add_argument("--out", type=writable_folder, default=Path("runs/regret"))
    parser.add_argument(
        "--controllers", nargs="+", default=list(DEFAULT), metavar="KIND|FOLDER", help=HELP
    )
    parser.add_argument("--episodes", type=int, default=64, help="that every controller runs")
    parser.add_argument("--duration", type=float, default=6.0, help="of an episode [s]")
    parser.add_argument("--workers", type=int, default=available_cores(), help="processes")
    chosen = parse_with_quick(parser, arguments, QUICK)
    check_positive(parser, chosen, "episodes", "duration", "workers")
    if chosen.episodes > VALIDATION_SEED - EVALUATION_SEED:
        parser.error(f"--episodes must be at most {VALIDATION_SEED - EVALUATION_SEED}")
    return chosen


def blocks_of(name: str, controller: Controller, episodes: int) -> list[Block]:
    """The random episodes of one controller, on plants within ±10 %."""
    size, cost = (BLOCK, COST) if isinstance(controller, CausalBound) else (episodes, 1)
    return [
        Block(
            run_name=name, version=fingerprint(controller), plants=TUNING_REGION, scenarios=(RANDOM,),
            first_seed=EVALUATION_SEED + first, count=min(size, episodes - first), cost=cost,
        )
        for first in range(0, episodes, size)
    ]  # fmt: skip


def regret_table(found: dict[str, EpisodeMetrics], bound: str) -> pd.DataFrame:
    """Each controller's figures less the bound's in the same episodes, the best return first."""
    rows = []
    for name, metrics in found.items():
        if name == bound:
            continue
        row: dict[str, Any] = {"controller": name, "left": int((~metrics.stayed).sum())}
        for figure in FIGURES:
            own, best = (
                figure.factor * getattr(each, figure.name)[None, None]
                for each in (metrics, found[bound])
            )
            lost = paired_difference(own, best)
            row |= {figure.heading: lost.value}
            row |= {f"{figure.heading}, low": lost.low, f"{figure.heading}, high": lost.high}
        rows.append(row)
    return pd.DataFrame(rows).sort_values(FIGURES[0].heading, ignore_index=True)


def as_markdown(table: pd.DataFrame) -> str:
    """The table with its intervals, as documentation shows it."""
    headings = ["controller", "left", *(figure.heading for figure in FIGURES)]
    rows = []
    for row in records(table):
        cells = [
            f"{row[f.heading]:.3g} ({row[f'{f.heading}, low']:.3g} to {row[f'{f.heading}, high']:.3g})"
            for f in FIGURES
        ]
        rows.append([row["controller"], str(row["left"]), *cells])
    return markdown(headings, rows)


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    chosen = parse(arguments)
    plant = Plant.calibrated()
    bound = CausalBound()
    named, _ = named_controllers(chosen.controllers, plant)
    controllers = {bound.name: bound, **named}
    blocks = [b for name, c in controllers.items() for b in blocks_of(name, c, chosen.episodes)]
    study = Study(controllers=controllers, plant=plant, scenario=MIXED, duration=chosen.duration)
    with only_writer(chosen.out):
        with task_runner(chosen.workers, None) as run:
            results = block_results(blocks, study, chosen.out / "blocks.jsonl", run, what="regret")
        found = {name: results[name, TUNING_REGION, RANDOM] for name in controllers}
        table = regret_table(found, bound.name)
        own = found[bound.name]
        content = {
            "format": "epv-regret/1", "episodes": chosen.episodes, "duration_s": chosen.duration,
            "bound": {f.heading: float(f.factor * getattr(own, f.name).mean()) for f in FIGURES}
            | {"left": int((~own.stayed).sum())},
            "rows": records(table),
        }  # fmt: skip
        write_json(chosen.out / "regret.json", content, allow_nan=False)
    print(f"{bound.name}: {content['bound']}\n\n{as_markdown(table)}")
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
