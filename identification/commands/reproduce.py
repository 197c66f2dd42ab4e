"""The report's tables beside ours."""

import argparse

from identification.commands.options import add_out, add_seed
from identification.report.result_files import as_text
from identification.studies.reproduction.reproduction import reproduce


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the folder of results and the seed."""
    add_out(parser)
    add_seed(parser, help="of the virtual bench's noise")


def run(options: argparse.Namespace) -> None:
    """Compute every table and write both files."""
    sections = reproduce(options.out, seed=options.seed)
    print(as_text(sections))
    print(f"\nwritten: {options.out}/reproduce.json and reproduce.html")
