"""Diagnose a tank's recordings: your own, or those of a virtual tank with a leak."""

import argparse
import sys
from pathlib import Path

from docs.examples.tank.plant import Tank
from docs.examples.tank.recordings import read_runs, virtual_recordings, write_runs
from epv_env.common.command_line import fail_clearly, writable_folder
from identification.gap.diagnosis import diagnose
from identification.gap.gap_json import write_results
from identification.gap.report_figures import missing_term_figure
from identification.gap.report_page import sections
from identification.gap.sentences import verdict_sentence
from identification.report.page import write_page

LEAKING = {"c": 0.021, "leak": 4e-3}
"""The virtual tank; its recordings are written to --out, and read from there."""


def main() -> int:
    """Diagnose, write gap.json and report.html, print the verdict; returns the exit status."""
    parser = argparse.ArgumentParser(description="Why a model of a tank misses its recordings.")
    parser.add_argument("--out", type=writable_folder, required=True, help="folder of results")
    parser.add_argument("--recordings", type=Path, default=None, help="folder of your own CSV files")
    parser.add_argument("--seed", type=int, default=0, help="of resampling, and of the virtual noise")
    parser.add_argument("--images", type=writable_folder, default=None, help="folder of gap-tank.png")
    chosen = parser.parse_args()
    folder = chosen.recordings
    if folder is None:
        folder = chosen.out / "recordings"
        write_runs(virtual_recordings(LEAKING, chosen.seed), folder)
    diagnosis = diagnose(Tank(read_runs(folder)), seed=chosen.seed)
    write_results(diagnosis, chosen.out)
    title = f"Gap between model and recordings: {folder}"
    write_page(chosen.out / "report.html", title=title, sections=sections(diagnosis))
    term = diagnosis.localisation.missing_term
    if chosen.images and term:
        chosen.images.mkdir(parents=True, exist_ok=True)
        missing_term_figure(term).savefig(chosen.images / "gap-tank.png", dpi=100)
    print(verdict_sentence(diagnosis, "")[1])
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
