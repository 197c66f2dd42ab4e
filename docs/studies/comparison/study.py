"""Compare five controllers: random episodes on three plant sets, scenarios beyond training, sensors that
fail, worn valves.

    python -m docs.studies.comparison.study

writes comparison.csv, differences.csv, beyond.csv, comparison.png, and the tables of both README.md.
What is finished is kept in runs/comparison/CODE and not run again.
"""

import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from docs.studies.common import PAGE, ROOT, fill, study_options, study_parser, table
from epv_env.common.command_line import fail_clearly
from epv_env.common.options import parse
from training.commands import compare
from training.evaluation.scenarios import BEYOND, FAULTY
from training.evaluation.sensor_faults import FAULTS

FOLDER = Path(__file__).parent
CONTROLLERS = (
    "PPO",
    "adaptive pulse with rules",
    "adaptive pulse",
    "extrapolating hysteresis",
    "PWM",
)
"""The learned one, then what it is built on, and classic ones."""
EPISODES, QUICK = 4096, 4
"""Episodes in each plant set, and under --quick."""
PLANTS = "sensitive_ten_percent"
"""Plant set of the page's table and picture, and of the scenarios beyond training."""
GROUPS = {
    "beyond": (1024, CONTROLLERS[:4]),
    "faults": (1024, CONTROLLERS[:1]),
    "worn": (128, CONTROLLERS[:4]),
}
"""Episodes in each scenario of a group, and its controllers: what a control unit can run, but PWM, which
leaves the band in ordinary episodes. The hysteresis reads no sensor that fails."""
BEYOND_COLUMNS = [
    "scenario", "controller", "left_percent", "left_low", "left_high", "C1_worst_excursion_bar",
]  # fmt: skip
SHARE = "{left_percent:.2g} ({left_low:.2g} to {left_high:.2g})"
"""Violation rate with its interval [%]."""
COLUMNS = {
    "C1_worst_excursion_bar": ("worst excursion [bar]", "{:.2f}"),
    "rms_error_mbar": ("rms error [mbar]", "{:.0f}"),
    "C2_event_breakdown_mbar": ("pressure dip [mbar]", "{:.0f}"),
    "switchings_per_s": ("switchings [1/s]", "{:.1f}"),
    "mean_return": ("return", "{:.0f}"),
    "decision_us": ("decision [µs]", "{:.0f}"),
}
"""Columns of the page's table: heading and format."""


def run_compare(out: Path, controllers: Sequence[str], *arguments: object, quick: bool) -> None:
    """Run the command `epv compare`."""
    words = ["--controllers", *controllers, "--out", out, *arguments, *(["--quick"] if quick else [])]
    compare.run(parse(compare, "compare", [str(word) for word in words]))


def page_table(rows: pd.DataFrame) -> str:
    """The page's table. rows: of comparison.csv."""
    lines = []
    for row in rows.query("plants == @PLANTS").to_dict("records"):
        cells = [form.format(row[column]) for column, (_, form) in COLUMNS.items()]
        lines.append([str(row["controller"]), SHARE.format(**row), *cells])
    headings = ["controller", "violation rate [%]", *(heading for heading, _ in COLUMNS.values())]
    return table(headings, lines)


def beyond_table(rows: pd.DataFrame) -> str:
    """Violation rate [%]: a row for each scenario, a column for each controller. The policy's has its
    interval.

    rows: of beyond.csv.
    """
    forms = dict.fromkeys(CONTROLLERS, "{left_percent:.2g}") | {CONTROLLERS[0]: SHARE}
    cells = [forms[row["controller"]].format(**row) for row in rows.to_dict("records")]
    wide = rows.assign(cell=cells).pivot(index="scenario", columns="controller", values="cell")
    controllers = GROUPS["beyond"][1]
    lines = [[name, *wide.loc[name, list(controllers)]] for name in BEYOND]
    return table(["scenario", *controllers], lines)


def fault_table(rows: pd.DataFrame) -> str:
    """The policy's violation rate [%]: a row for each fault, a column for each sensor.

    rows: of beyond.csv.
    """
    rates = {row["scenario"]: f"{row['left_percent']:.2g}" for row in rows.to_dict("records")}
    lines = [[fault, *(rates[f"{name} {fault}"] for name in FAULTY)] for fault in FAULTS[:-1]]
    swapped = rates["p1 and p3 swapped"]
    return table(["fault", *FAULTY], [*lines, ["swapped", swapped, swapped, "–"]])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    options = study_options(study_parser(__doc__ or "", FOLDER), arguments)
    work = options.work / "comparison"
    quick, beyond = options.quick, []
    work.mkdir(parents=True, exist_ok=True)
    run_compare(work, CONTROLLERS, "--episodes", QUICK if quick else EPISODES, quick=quick)
    for name, (episodes, controllers) in GROUPS.items():
        if quick and name == "worn":
            continue
        folder = work.with_name(f"comparison-{name}")
        folder.mkdir(parents=True, exist_ok=True)
        own = ("--scenarios", name, "--plants", PLANTS, "--episodes", QUICK if quick else episodes)
        run_compare(folder, controllers, *own, quick=quick)
        beyond.append(pd.read_csv(folder / "comparison.csv"))
    for name in ("comparison.csv", "differences.csv", "comparison.png"):
        shutil.copy(work / name, options.out / name)
    rows = pd.concat(beyond)
    rows[BEYOND_COLUMNS].to_csv(options.out / "beyond.csv", index=False, float_format="%.3g")
    blocks = {"controllers": page_table(pd.read_csv(work / "comparison.csv"))}
    blocks |= {"beyond": beyond_table(rows), "faults": fault_table(rows)}
    fill(options.out / PAGE, blocks)
    if not quick:
        fill(ROOT / "README.md", {"controllers": blocks["controllers"]})
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
