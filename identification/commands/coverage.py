"""`python -m identification coverage`: how often the intervals contain the true parameters."""

import argparse

from identification.commands.command import Command
from identification.commands.options import add_count, add_out, add_seed, add_workers
from identification.report.result_files import as_text, write_results
from identification.studies.coverage.coverage import CAMPAIGNS, coverage_study
from identification.studies.coverage.coverage_section import coverage_json, coverage_section


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the folder of results and the size of the study."""
    add_out(parser)
    add_count(parser, "--campaigns", default=CAMPAIGNS, help="number of twin campaigns")
    add_seed(parser, help="of the campaigns' noise")
    add_workers(parser)


def run(chosen: argparse.Namespace) -> None:
    """Run the study and write its page and JSON file."""
    coverage = coverage_study(
        journal=chosen.out / "coverage.jsonl",
        campaigns=chosen.campaigns,
        seed=chosen.seed,
        workers=chosen.workers,
    )
    section = coverage_section(coverage)
    write_results(
        chosen.out, "coverage", title=section.title, sections=[section], content=coverage_json(coverage)
    )
    print(as_text([section]))


COVERAGE = Command(
    name="coverage",
    help="how often the intervals hold the truth, over twin campaigns",
    add_options=add_options,
    run=run,
)
"""The command, for the registry."""
