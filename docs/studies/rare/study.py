"""How rarely controllers leave the band, and what failing sensors do.

    python -m docs.studies.rare.study

writes rare.csv, sensors.csv, rare.png and the tables of README.md but that of the statement. Finished
repetitions are kept in runs/rare and not run again.
"""

import json
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from controllers.policy import load_policy
from controllers.tuned import tuned
from docs.studies.common import PAGE, ROOT, fill, study_options, study_parser, table
from docs.studies.rare.sensors import SINGLE, fault_table
from epv_env.common.command_line import fail_clearly
from epv_env.common.options import parse
from training.commands import rare
from training.evaluation.seeds import RANGE, STATEMENT_SEED

FOLDER = Path(__file__).parent
RUNS: dict[str, tuple[str, ...]] = {
    "hyst-ten": ("--controller", "extrapolating hysteresis"),
    "pulse-ten": ("--controller", "adaptive pulse"),
    "rules-ten": ("--controller", "adaptive pulse with rules"),
    "ppo-ten": (),
    "ppo-conf": ("--region", "confidence", "--least", "1e-6"),
}
"""Options of `epv rare` by the name of the folder of results."""
SIZE = ("--particles", "2048", "--repetitions", "10")
FAULT_EPISODES = 12
"""Of each fault alone; a quarter of it of each pair."""
FAULT_SEED = STATEMENT_SEED + RANGE
BEHIND = ("adaptive pulse", "extrapolating hysteresis")
"""Controllers whose sensors fail beside the policy's."""


def rare_rows(work: Path) -> pd.DataFrame:
    """A row for each run that has finished."""
    rows = []
    for name in RUNS:
        path = work / name / "results.json"
        if path.exists():
            found = json.loads(path.read_text(encoding="utf-8"))
            rows.append({"plants": found["settings"]["region"], "controller": found["label"], **found})
    columns = ["plants", "controller", "excursion_bar", "probability", "low", "high", "runs"]
    return pd.DataFrame(rows)[[*columns, "plain_episodes"]]


def markdown(rows: pd.DataFrame) -> str:
    """Rows as a table of the page, three digits."""
    texts = rows.map(lambda cell: f"{cell:.3g}" if isinstance(cell, float) else str(cell))
    return table(list(rows.columns), texts.to_numpy().tolist())


def sensor_rows(found: pd.DataFrame) -> pd.DataFrame:
    """Faults of one sensor where some controller left: share that leaves, and worst excursion."""
    worst = found["worst_bar"].map("{:.2f}".format).replace("inf", "empties")
    text = found["left_percent"].map("{:.0f}%, ".format) + worst
    found = found[found.groupby("fault")["left_percent"].transform("max") > 0]
    wide = found.assign(text=text).pivot(index="fault", columns="controller", values="text")
    single = [f"{channel} {fault}" for ((channel, fault),) in SINGLE]
    return wide.loc[[name for name in single if name in wide.index]].reset_index()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    options = study_options(study_parser(__doc__ or "", FOLDER), arguments)
    work = (options.out if options.quick else ROOT / "runs") / "rare"
    for name, words in list(RUNS.items())[: 1 if options.quick else None]:
        size = ("--quick",) if options.quick else SIZE
        rare.run(parse(rare, "rare", [*words, *size, "--out", str(work / name)]))
    rows = rare_rows(work)
    rows.to_csv(options.out / "rare.csv", index=False, float_format="%.4g")
    if (picture := work / "ppo-ten" / "rare.png").exists():
        shutil.copy(picture, options.out / "rare.png")
    controllers: dict[str, Any] = {"PPO": load_policy(), **{name: tuned(name) for name in BEHIND}}
    faults = fault_table(controllers, 1 if options.quick else FAULT_EPISODES, FAULT_SEED)
    faults.to_csv(options.out / "sensors.csv", index=False, float_format="%.3g")
    parts = {"rare": markdown(rows), "sensors": markdown(sensor_rows(faults))}
    fill(options.out / PAGE, parts)
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
