"""How often the diagnosis is right on campaigns whose cause is sealed."""

import argparse
from typing import Any

from epv_env.common.command_line import writable_folder
from epv_env.plant.valves import available_cores
from identification.commands.options import add_count, add_out, add_seed, add_workers
from identification.report.page import Section
from identification.report.result_files import as_text
from identification.studies.blind.blind_study import RESULTS, blind_check
from identification.studies.blind.disturbances import DISTURBANCES
from identification.studies.blind.robustness import robustness_check
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
    parser.add_argument(
        "--disturb",
        choices=DISTURBANCES,
        action="append",
        default=[],
        help="diagnose the trials of a finished study again under a disturbance: "
        + "; ".join(f"{name}: {meaning}" for name, meaning in DISTURBANCES.items()),
    )
    parser.add_argument("--images", type=writable_folder, default=None, help="folder of its figures")


def _deviations() -> str:
    """The deviations of each study's forms, ready to read."""
    ranges = {name: [100.0 * end for end in s.form_deviation] for name, s in FORMS.items()}
    return "; ".join(f"{name} {low:.0f} to {high:.0f} %%" for name, (low, high) in ranges.items())


def run(options: argparse.Namespace) -> None:
    """Run the study, or diagnose it again under disturbances.

    Raises ValueError for a folder of another seed or other forms, or of too few trials for disturbances.
    """
    if options.disturb:
        for disturbance in options.disturb:
            section = robustness_check(options.out, disturbance, **_common(options))
            _tell(section, f"{options.out}/robustness-{disturbance}")
    else:
        section = blind_check(options.out, images=options.images, **_common(options))
        _tell(section, f"{options.out}/{RESULTS}")


def _common(options: argparse.Namespace) -> dict[str, Any]:
    """Arguments that both kinds of study take."""
    return {
        "trials": options.trials,
        "seed": options.seed,
        "workers": options.workers or available_cores(),
        "diagnosis": diagnose_campaign,
        "settings": FORMS[options.forms],
    }


def _tell(section: Section, files: str) -> None:
    print(as_text([section]))
    print(f"\nwritten: {files}.json and .html")
