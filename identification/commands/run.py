"""Identify the valve from a campaign: plant.json and report.html, or one stage of them.

The stages are data quality, sensitivity, calibration, confidence and validation. Finished searches are
kept in the folder of results, so that stages which are run one by one share them.
"""

import argparse

from epv_env.common.command_line import (
    COUNT,
    NextStep,
    add_out,
    add_plant,
    add_seed,
    beside,
    plant_option,
)
from epv_env.plant.plantfile import load_plant
from identification.calibration.calibrate import STARTS
from identification.pipeline import run as pipeline
from identification.pipeline.identification import Identification
from identification.pipeline.run import STAGES
from identification.pipeline.summary import summary_section
from identification.recordings.campaign_files import read_campaign
from identification.recordings.recording import campaign_facts
from identification.recordings.rules import RULES, rules_of
from identification.report.page import as_text, write_results

JOURNAL = "searches.jsonl"
"""File of the finished searches in the folder of results."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the campaign, the folder of results, the stage, the seed and the number of starts."""
    parser.add_argument(
        "campaign", help="folder with campaign.json and the recordings (docs/reference/files.md)"
    )
    add_out(parser)
    stages = "; ".join(f"{stage.name}: {stage.help}" for stage in STAGES)
    parser.add_argument(
        "--stage",
        choices=[stage.name for stage in STAGES],
        default=None,
        help=f"write the page and the JSON file of this stage only ({stages})",
    )
    add_plant(parser, help="plant file of another valve than the report's, as its data sheet has it")
    add_seed(parser, help="of starts, draws and resampling")
    parser.add_argument("--starts", type=COUNT, default=STARTS, help="searches of each method")


def run(options: argparse.Namespace) -> None:
    """Run all stages on the campaign, or one. Raises CampaignError."""
    plant = load_plant(options.plant) if options.plant else None
    campaign = read_campaign(options.campaign, rules_of(plant) if plant else RULES)
    searches, chosen = options.out / JOURNAL, {"seed": options.seed, "starts": options.starts}
    identification = Identification(campaign, searches, plant=plant, **chosen)
    if options.stage:
        _run_stage(options, identification)
        return
    pipeline.run(identification, options.out, next_step(options))
    print(as_text([summary_section(identification)]))
    print(f"written: {options.out / pipeline.PLANT_FILE}, {options.out}/report.html and report.json")


def next_step(options: argparse.Namespace) -> NextStep:
    """Diagnose what the model lacks; after one stage, run them all with the same searches."""
    plant = plant_option(options.plant)
    if options.stage:
        same = ("--seed", options.seed, "--starts", options.starts)
        words = ("run", options.campaign, "--out", options.out, *plant, *same)
        return NextStep("to run all stages and write plant.json", words)
    words = ("gap", options.campaign, "--out", beside(options.out, "gap"), *plant)
    return NextStep("to find out what the model lacks", words)


def _run_stage(options: argparse.Namespace, identification: Identification) -> None:
    stage = next(stage for stage in STAGES if stage.name == options.stage)
    sections, content = stage.compute(identification)
    write_results(
        options.out,
        stage.name,
        content,
        title=f"{stage.name}: {options.campaign}",
        sections=sections,
        facts=campaign_facts(identification.campaign),
        next_step=next_step(options),
    )
    print(as_text(sections))
    print(f"\nwritten: {options.out / stage.name}.html and .json")
