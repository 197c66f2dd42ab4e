"""Every controller on scenarios beyond training: far starts, rests, starvation, faults, worn valves.

    python training/hard_scenarios.py --out runs/hard
    python training/hard_scenarios.py --out runs/hard --scenarios restart "p3 frozen" --controllers pulse

docs/how-to/compare-controllers.md explains the table.
"""

import training.console.missing_packages  # noqa: F401 - before what may be missing

# isort: split
import argparse
import sys
from pathlib import Path
from typing import Any

import pandas as pd
from tqdm import tqdm

from controllers.supervised import FALLBACK, p3_checked
from controllers.tuned import load_tunings
from epv_env.common.command_line import (
    check_positive,
    fail_clearly,
    parse_with_quick,
    writable_folder,
)
from epv_env.common.files import write_json
from epv_env.plant.consumption import MIXED
from epv_env.plant.plantfile import load_plant
from training.evaluation.seeds import EVALUATION_SEED, VALIDATION_SEED
from training.studies.episode_tasks import Study
from training.studies.hard_scenarios import all_scenarios, rows
from training.studies.named_controllers import (
    DEFAULT,
    HELP,
    named_controllers,
)

RESULT = "hard_scenarios.json"
FORMAT = "epv-hard-scenarios/1"

QUICK: dict[str, Any] = {"controllers": list(DEFAULT[:1]), "episodes": 2, "scenarios": ["restart"]}
"""The defaults under --quick: too few episodes to tell anything."""


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line's options, checked."""
    known = list(all_scenarios())
    parser = argparse.ArgumentParser(description="Controllers on scenarios beyond training.")
    parser.add_argument("--out", type=writable_folder, default=Path("runs/hard"))
    parser.add_argument(
        "--controllers", nargs="+", default=list(load_tunings()), metavar="KIND|FOLDER",
        help=f"{HELP}; default: every tuned kind",
    )  # fmt: skip
    parser.add_argument(
        "--scenarios", nargs="+", default=known, metavar="NAME", help="only these; default: all"
    )
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--episodes", type=int, default=256, help="of each scenario and controller")
    which.add_argument(
        "--seeds", type=int, nargs="+", default=None, metavar="SEED",
        help="the episodes with these seeds instead, as `left_seeds` of an earlier result names them",
    )  # fmt: skip
    parser.add_argument("--plant", default=None, help="plant file; default: the report's calibration")
    parser.add_argument(
        "--p3-check", action="store_true",
        help=f"{FALLBACK!r} takes over from each controller once p3 is implausible",
    )  # fmt: skip
    chosen = parse_with_quick(parser, arguments, QUICK)
    check_positive(parser, chosen, "episodes")
    if chosen.episodes > VALIDATION_SEED - EVALUATION_SEED:
        parser.error(f"--episodes must be at most {VALIDATION_SEED - EVALUATION_SEED}")
    for seed in chosen.seeds or ():
        if not EVALUATION_SEED <= seed < VALIDATION_SEED:
            parser.error(
                f"--seeds: {seed} is none from {EVALUATION_SEED} to {VALIDATION_SEED - 1}: "
                "give seeds of the evaluation"
            )
    if unknown := [name for name in chosen.scenarios if name not in known]:
        parser.error(f"no scenario {unknown[0]!r}: choose from {', '.join(known)}")
    return chosen


def as_text(table: pd.DataFrame) -> str:
    """Share of episodes that leave the band by scenario and controller, as it is printed."""
    left = table.assign(left=100 * (1 - table["C1_stayed"]))
    wide = left.pivot_table(index="scenario", columns="controller", values="left", sort=False)
    return "episodes that leave target ±500 mbar [%]\n" + wide.to_string(float_format="%.1f")


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    chosen = parse(arguments)
    plant = load_plant(chosen.plant)
    controllers, digests = named_controllers(chosen.controllers, plant)
    scenarios = {name: all_scenarios()[name] for name in chosen.scenarios}
    if chosen.p3_check:
        controllers = {label: p3_checked(each, plant) for label, each in controllers.items()}
    study = Study(controllers=controllers, plant=plant, scenario=MIXED, duration=10.0)
    seeds = chosen.seeds or range(EVALUATION_SEED, EVALUATION_SEED + chosen.episodes)
    count = len(scenarios) * len(controllers)
    found = list(tqdm(rows(study, scenarios, seeds), total=count, file=sys.stderr))
    content = {
        "format": FORMAT, "plant": plant.name, "episodes": len(seeds), "controllers": digests,
        "scenarios": {name: scenario.meaning for name, scenario in scenarios.items()}, "rows": found,
    }  # fmt: skip
    write_json(chosen.out / RESULT, content, allow_nan=False)
    print(as_text(pd.DataFrame(found)))
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
