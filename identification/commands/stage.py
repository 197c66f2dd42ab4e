"""`python -m identification quality`, `sensitivity`, `calibrate`, `confidence`, `validate`."""

import argparse

from identification.commands.campaign_options import add_options, chosen_identification
from identification.commands.command import Command
from identification.pipeline.stages import STAGES, Stage
from identification.report.result_files import as_text, write_results


def stage_command(stage: Stage) -> Command:
    """The command that runs one stage of the identification and writes its page and JSON file."""

    def run(chosen: argparse.Namespace) -> None:
        result = stage.compute(chosen_identification(chosen))
        title = f"{stage.name}: {chosen.campaign}"
        write_results(
            chosen.out, stage.name, title=title, sections=result.sections, content=result.content
        )
        print(as_text(result.sections))
        print(f"\nwritten: {chosen.out / stage.name}.html and .json")

    return Command(name=stage.name, help=stage.help, add_options=add_options, run=run)


STAGE_COMMANDS = tuple(stage_command(stage) for stage in STAGES)
"""One command per stage, in the order of the report."""
