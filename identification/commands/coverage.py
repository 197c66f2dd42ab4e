"""How often the intervals hold the truth, over twin campaigns."""

import argparse

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


def run(options: argparse.Namespace) -> None:
    """Run the study and write its page and JSON file."""
    coverage = coverage_study(
        journal=options.out / "coverage.jsonl",
        campaigns=options.campaigns,
        seed=options.seed,
        workers=options.workers,
    )
    section = coverage_section(coverage)
    write_results(
        options.out, "coverage", title=section.title, sections=[section], content=coverage_json(coverage)
    )
    print(as_text([section]))
