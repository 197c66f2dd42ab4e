"""`python -m identification blind`."""

import argparse

from epv_env.common.command_line import writable_folder
from epv_env.plant.valves import available_cores
from identification.report.result_files import as_text
from identification.studies.blind.blind_study import blind_check
from identification.valve_gap.diagnose import diagnose_campaign

TRIALS = 300


def add_blind(commands: "argparse._SubParsersAction") -> None:
    """The command's options."""
    text = "how often the diagnosis is right on campaigns whose cause is sealed"
    parser = commands.add_parser("blind", help=text, description=text)
    parser.add_argument(
        "--out", type=writable_folder, required=True, help="folder of trials and results"
    )
    parser.add_argument("--trials", type=int, default=TRIALS, help="number of campaigns")
    parser.add_argument("--seed", type=int, default=0, help="of truths and noise")
    parser.add_argument("--workers", type=int, default=None, help="processes; default: all cores")
    parser.add_argument("--images", type=writable_folder, default=None, help="folder of its figures")


def blind(chosen: argparse.Namespace) -> None:
    """Run the command. Raises ValueError for a folder of another study."""
    section = blind_check(
        chosen.out,
        trials=chosen.trials,
        seed=chosen.seed,
        workers=chosen.workers or available_cores(),
        diagnosis=diagnose_campaign,
        images=chosen.images,
    )
    print(as_text([section]))
    print(f"\nwritten: {chosen.out}/results.json and results.html")
