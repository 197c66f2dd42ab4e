"""Draw the figures of docs/explanation/identification.md from a virtual bench.

python docs/scripts/identification_figures.py --out docs/images --coverage runs/coverage
"""

import argparse
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from matplotlib.figure import Figure

from epv_env.common.command_line import fail_clearly, writable_folder
from epv_env.plant.parameters import Parameters
from identification.bench.programmes import REPORT_SUITE
from identification.bench.session import run_bench
from identification.calibration.multi_start import METHODS
from identification.calibration.settings import CalibrationSettings
from identification.confidence import confidence_figures
from identification.pipeline.identification import Identification
from identification.pipeline.settings import IdentificationSettings
from identification.replay.response_figures import response_figure
from identification.studies.coverage.coverage import coverage_study
from identification.studies.coverage.coverage_figure import distance_quantiles

ONE_START = IdentificationSettings(calibration=CalibrationSettings(starts=1))


def identification_figures(coverage: Path, campaigns: int) -> dict[str, Figure]:
    """Figures by file name.

    coverage: folder of the coverage study's journal. campaigns: number of campaigns of the study.
    """
    campaign = run_bench(REPORT_SUITE, Parameters.calibrated(), seed=0)
    with TemporaryDirectory() as folder:
        identification = Identification(campaign, Path(folder) / "searches.jsonl", settings=ONE_START)
        study = coverage_study(journal=coverage / "coverage.jsonl", campaigns=campaigns)
        return {
            "calibration.png": response_figure(identification.calibration.after[METHODS[0]][0]),
            "region.png": confidence_figures.region(identification.confidence),
            "coverage.png": distance_quantiles(study),
        }


def main() -> int:
    """Draw and write; returns the exit status."""
    parser = argparse.ArgumentParser(
        description="Draw the figures of docs/explanation/identification.md."
    )
    parser.add_argument("--out", type=writable_folder, required=True, help="folder of the pictures")
    parser.add_argument(
        "--coverage", type=writable_folder, required=True, help="folder of a coverage study, resumed"
    )
    parser.add_argument("--campaigns", type=int, default=200, help="of the coverage study")
    chosen = parser.parse_args()
    figures_by_name = identification_figures(chosen.coverage, chosen.campaigns)
    chosen.out.mkdir(parents=True, exist_ok=True)
    for name, figure in figures_by_name.items():
        figure.savefig(chosen.out / name, dpi=100, bbox_inches="tight")
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
