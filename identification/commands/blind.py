"""`python -m identification blind`: how often the diagnosis is right on sealed campaigns."""

import argparse

from epv_env.common.command_line import writable_folder
from epv_env.plant.valves import available_cores
from identification.commands.command import Command
from identification.commands.options import add_count, add_out, add_seed, add_workers
from identification.report.result_files import as_text
from identification.studies.blind.blind_study import blind_check
from identification.studies.blind.settings import DEFAULTS, FORMS
from identification.valve_gap.diagnose import diagnose_campaign

TRIALS = 300
"""Campaigns of a full study."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the folder of results, the size of the study, and where its figures go."""
    add_out(parser, help="folder of trials and results")
    add_count(parser, "--trials", default=TRIALS, help="number of campaigns")
    add_seed(parser, help="of truths and noise")
    add_workers(parser)
    parser.add_argument(
        "--forms",
        choices=FORMS,
        default=DEFAULTS.forms,
        help=f"how far the effects' forms are from the fitted ones: {_deviations()}",
    )
    parser.add_argument("--images", type=writable_folder, default=None, help="folder of its figures")


def _deviations() -> str:
    """The deviations of each study's forms, ready to read."""
    ranges = {name: [100.0 * end for end in s.form_deviation] for name, s in FORMS.items()}
    return "; ".join(f"{name} {low:.0f} to {high:.0f} %%" for name, (low, high) in ranges.items())


def run(chosen: argparse.Namespace) -> None:
    """Run the study. Raises ValueError for a folder of another seed or other forms."""
    section = blind_check(
        chosen.out,
        trials=chosen.trials,
        seed=chosen.seed,
        workers=chosen.workers or available_cores(),
        diagnosis=diagnose_campaign,
        images=chosen.images,
        settings=FORMS[chosen.forms],
    )
    print(as_text([section]))
    print(f"\nwritten: {chosen.out}/results.json and results.html")


BLIND = Command(
    name="blind",
    help="how often the diagnosis is right on campaigns whose cause is sealed",
    add_options=add_options,
    run=run,
)
"""The command, for the registry."""
