"""Train, deploy on a virtual bench, diagnose, retrain, deploy again.

    python -m docs.studies.sim_to_real.study

writes sim-to-real.json, performance.csv, sim-to-real.png and the table of README.md. Finished steps are
kept in runs/sim-to-real and not repeated.
"""

import json
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from docs.studies.common import PAGE, ROOT, fill, study_options, study_parser, table
from epv_env.common.command_line import fail_clearly
from epv_env.common.commands import parse
from training.commands import sim_to_real
from training.studies.sim_to_real import diagnosis_text, short_table

FOLDER = Path(__file__).parent
SHOWN = ("PPO", "pulse, adaptive", "hysteresis, extrapolating", "PWM")
"""Controllers of the page's table; performance.csv has all."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    options = study_options(study_parser(__doc__ or "", FOLDER), arguments)
    work = (options.out if options.quick else ROOT / "runs") / "sim-to-real"
    work.mkdir(parents=True, exist_ok=True)
    words = ["--out", str(work), *(["--quick"] if options.quick else [])]
    sim_to_real.run(parse(sim_to_real, "sim-to-real", words))
    for name in (sim_to_real.RESULT, "performance.csv", sim_to_real.PICTURE):
        shutil.copy(work / name, options.out / name)
    result = json.loads((work / sim_to_real.RESULT).read_text(encoding="utf-8"))
    shown = short_table(pd.DataFrame(result["aims"]), pd.DataFrame(result["gaps"]))
    shown = shown[shown["controller"].isin(SHOWN)]
    parts = {
        "diagnosis": diagnosis_text(result["diagnosis"], result["withheld"]),
        "controllers": table(list(shown.columns), shown.to_numpy().tolist()),
    }
    fill(options.out / PAGE, parts)
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
