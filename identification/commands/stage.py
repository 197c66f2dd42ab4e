"""`python -m identification quality`, `sensitivity`, `calibrate`, `confidence`, `validate`."""

import argparse

from identification.commands.campaign_options import add_options, chosen_identification
from identification.commands.command import Command
from identification.pipeline.stages import STAGES, Stage
from identification.recordings.recording import campaign_facts
from identification.report.result_files import as_text, write_results


def stage_command(stage: Stage) -> Command:
    """The command that runs one stage of the identification and writes its page and JSON file."""

    def run(chosen: argparse.Namespace) -> None:
        identification = chosen_identification(chosen)
        result = stage.compute(identification)
        write_results(
            chosen.out,
            stage.name,
            title=f"{stage.name}: {chosen.campaign}",
            sections=result.sections,
            content=result.content,
            facts=campaign_facts(identification.campaign),
            report_2003=chosen.report_2003,
        )
        print(as_text(result.sections))
        print(f"\nwritten: {chosen.out / stage.name}.html and .json")

    return Command(name=stage.name, help=stage.help, add_options=add_options, run=run)


STAGE_COMMANDS = tuple(stage_command(stage) for stage in STAGES)
"""One command per stage, in the order of the report."""
