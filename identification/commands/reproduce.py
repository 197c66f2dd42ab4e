"""`python -m identification reproduce`: the report's tables beside the recomputed ones."""

import argparse

from identification.commands.command import Command
from identification.commands.options import add_out, add_seed
from identification.report.result_files import as_text
from identification.studies.reproduction.reproduction import reproduce


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the folder of results and the seed."""
    add_out(parser)
    add_seed(parser, help="of the virtual bench's noise")


def run(chosen: argparse.Namespace) -> None:
    """Compute every table and write both files."""
    sections = reproduce(chosen.out, seed=chosen.seed)
    print(as_text(sections))
    print(f"\nwritten: {chosen.out}/reproduce.json and reproduce.html")


REPRODUCE = Command(
    name="reproduce", help="the report's tables beside ours", add_options=add_options, run=run
)
"""The command, for the registry."""
