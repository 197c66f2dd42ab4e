"""The options and the campaign that `run` and the commands of the single stages share."""

import argparse

from epv_env.plant.plantfile import load_plant
from identification.calibration.settings import CALIBRATION, CalibrationSettings
from identification.commands.options import add_count, add_out, add_plant, add_seed
from identification.pipeline.identification import Identification
from identification.pipeline.settings import IdentificationSettings
from identification.recordings.campaign_files import read_campaign
from identification.recordings.rules import RULES, rules_of

JOURNAL = "searches.jsonl"
"""File of the finished searches in the folder of results."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the campaign, the folder of results, the seed and the number of starts."""
    parser.add_argument(
        "campaign", help="folder with campaign.json and the recordings (docs/reference/files.md)"
    )
    add_out(parser)
    add_plant(parser, help="plant file of another valve than the report's, as its data sheet has it")
    add_seed(parser, help="of starts, draws and resampling")
    add_count(parser, "--starts", default=CALIBRATION.starts, help="searches of each method")
    parser.add_argument(
        "--report-2003", action="store_true", help="show the figures of the report SCL-001/2003 beside"
    )


def chosen_identification(chosen: argparse.Namespace) -> Identification:
    """The identification of the chosen campaign. Raises CampaignError."""
    plant = load_plant(chosen.plant) if chosen.plant else None
    campaign = read_campaign(chosen.campaign, rules_of(plant) if plant else RULES)
    settings = IdentificationSettings(calibration=CalibrationSettings(starts=chosen.starts))
    return Identification(
        campaign,
        chosen.out / JOURNAL,
        seed=chosen.seed,
        plant=plant,
        settings=settings,
        report_2003=chosen.report_2003,
    )
