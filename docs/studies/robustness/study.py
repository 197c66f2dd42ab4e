"""Sweep plants, parameters and conditions under each controller.

    python -m docs.studies.robustness.study

writes points.csv, two pictures and the tables of README.md. What is finished is kept in runs/robustness
and not run again.
"""

import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from docs.studies.common import PAGE, ROOT, fill, study_options, study_parser, table
from epv_env.common.command_line import fail_clearly
from epv_env.common.options import parse
from training.commands import sweep
from training.studies.sweep_report import RANGE_ENDS, harmful_changes, region_table

FOLDER = Path(__file__).parent
CONTROLLERS = (
    "PPO",
    "adaptive pulse with rules",
    "extrapolating hysteresis",
    "PWM",
)
"""The learned one, the best classic one, a simple one, and the one that the report names."""
DESIGNS = ("--designs", "regions", "parameters", "conditions")
EPISODES = ("--episodes", "64", "--joint-episodes", "1024")
"""At each change, and on the plants of each region: a quarter of an hour of one core."""
QUICK = ("--quick", "--factors", "R", "V2", "latency")
PICTURES = ("robustness-parameters.png", "robustness-conditions.png")
UNSHOWN_REGIONS = ("confidence", "ten_percent")
"""Regions whose figures hardly differ from those of the calibrated plant: in points.csv only."""


def as_markdown(found: pd.DataFrame) -> str:
    """A table of a sweep in Markdown."""
    cells = [
        [f"{cell:.3g}" if isinstance(cell, float) else str(cell) for cell in row]
        for row in found.itertuples(index=False)
    ]
    return table(list(found.columns), cells)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    options = study_options(study_parser(__doc__ or "", FOLDER), arguments)
    work = (options.out if options.quick else ROOT / "runs") / "robustness"
    work.mkdir(parents=True, exist_ok=True)
    words = ["--out", str(work), *DESIGNS, *(QUICK if options.quick else EPISODES)]
    sweep.run(parse(sweep, "sweep", [*words, "--controllers", *CONTROLLERS]))
    for name in ("points.csv", *PICTURES):
        shutil.copy(work / name, options.out / name)
    points = pd.read_csv(work / "points.csv")
    near: Any = points[~points["level"].isin([*RANGE_ENDS, *UNSHOWN_REGIONS])]
    parts = {
        "regions": as_markdown(region_table(near)),
        "changes": as_markdown(harmful_changes(near)),
    }
    fill(options.out / PAGE, parts)
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
