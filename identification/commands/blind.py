"""How often the diagnosis is right on campaigns whose cause is sealed.

Draws truths, records campaigns on a bench of its own, commits to the truths, diagnoses the campaigns
blind, and only then opens the truths and scores. What a folder holds already is not done again.
"""

import argparse

from epv_env.common.command_line import COUNT, NextStep, add_out, add_seed, add_workers
from epv_env.common.files import write_json
from epv_env.plant.valves import available_cores
from identification.blind.report import as_text, reliability_figure, results
from identification.blind.trials import blind_scores
from identification.blind.truth import FORM_DEVIATIONS
from identification.valve_gap.diagnose import diagnose_campaign

TRIALS = 300
"""Campaigns of a full study."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the folder of results, the size of the study, and its forms."""
    add_out(parser, help="folder of trials and results")
    parser.add_argument("--trials", type=COUNT, default=TRIALS, help="number of campaigns")
    add_seed(parser, help="of truths and noise")
    add_workers(parser)
    ranges = [f"{name} {100 * a:.0f} to {100 * b:.0f} %%" for name, (a, b) in FORM_DEVIATIONS.items()]
    parser.add_argument(
        "--forms",
        choices=FORM_DEVIATIONS,
        default="usual",
        help=f"how far the effects' forms are from the fitted ones: {'; '.join(ranges)}",
    )


def run(options: argparse.Namespace) -> None:
    """Run the study. Raises ValueError for a folder of another seed or other forms."""
    scores = blind_scores(
        options.out,
        trials=options.trials,
        seed=options.seed,
        workers=options.workers or available_cores(),
        diagnosis=diagnose_campaign,
        forms=options.forms,
    )
    found = results(scores, seed=options.seed, forms=options.forms)
    write_json(options.out / "results.json", found, allow_nan=False)
    reliability_figure(found["calibration"]).savefig(options.out / "reliability.png", dpi=100)
    print(as_text(found))
    print(f"\nwritten: {options.out}/results.json and reliability.png")


def next_step(options: argparse.Namespace) -> NextStep:
    """More trials: those that are done count."""
    same = ("--seed", options.seed, "--forms", options.forms, "--out", options.out)
    return NextStep("for narrower intervals", ("blind", "--trials", 2 * options.trials, *same))
