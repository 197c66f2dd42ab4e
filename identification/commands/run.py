"""`python -m identification run`: every stage, the plant file and the report."""

import argparse

from identification.commands.campaign_options import add_options, chosen_identification
from identification.commands.command import Command
from identification.pipeline import run as pipeline


def run(chosen: argparse.Namespace) -> None:
    """Run all stages on the campaign. Raises CampaignError."""
    plant = pipeline.run(chosen_identification(chosen), chosen.out)
    for symbol in plant.region.symbols:
        print(f"{symbol:8} {plant.parameters[symbol]:.7g}")
    print(f"written: {chosen.out / pipeline.PLANT_FILE}, {chosen.out}/report.html and report.json")


RUN = Command(
    name="run", help="all of these: plant.json and report.html", add_options=add_options, run=run
)
"""The command, for the registry."""
