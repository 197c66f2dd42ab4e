"""Options that several commands share, with the checks of their values."""

import argparse
from pathlib import Path
from typing import Any

from epv_env.common.command_line import MOST, writable_folder

MOST_COUNTED = 100_000
"""Starts, trials, campaigns or processes, at most: more would run for years."""


def add_out(parser: argparse.ArgumentParser, *, help: str = "folder of results") -> None:
    """Add --out, a required folder that exists or can be made."""
    parser.add_argument("--out", type=writable_folder, required=True, help=help)


def add_plant(parser: argparse.ArgumentParser, *, help: str) -> None:
    """Add --plant, a plant file."""
    parser.add_argument("--plant", type=Path, metavar="FILE", default=None, help=help)


def add_seed(parser: argparse.ArgumentParser, *, help: str) -> None:
    """Add --seed, a whole number from 0 up; help: what the seed draws."""
    parser.add_argument("--seed", type=int, action=_Seed, default=0, help=help)


def add_count(parser: argparse.ArgumentParser, option: str, *, default: int | None, help: str) -> None:
    """Add a whole number that is at least 1, such as --trials."""
    parser.add_argument(option, type=int, action=_AtLeastOne, default=default, help=help)


def add_workers(parser: argparse.ArgumentParser) -> None:
    """Add --workers, the number of processes."""
    add_count(parser, "--workers", default=None, help="processes; default: all cores")


class _AtLeastOne(argparse.Action):
    """Stores a number; ends with one sentence if it is below 1."""

    def __call__(
        self, parser: argparse.ArgumentParser, chosen: argparse.Namespace, value: Any, option: Any = None
    ) -> None:
        if value < 1:
            parser.error(f"{self.option_strings[0]} must be at least 1")
        if value > MOST_COUNTED:
            parser.error(f"{self.option_strings[0]} must be at most {MOST_COUNTED}")
        setattr(chosen, self.dest, value)


class _Seed(argparse.Action):
    """Stores a number; ends with one sentence if it is no seed of a generator."""

    def __call__(
        self, parser: argparse.ArgumentParser, chosen: argparse.Namespace, value: Any, option: Any = None
    ) -> None:
        if value < 0:
            parser.error(f"{self.option_strings[0]} must not be negative")
        if value > MOST["seed"]:
            parser.error(f"{self.option_strings[0]} must be at most {MOST['seed']}")
        setattr(chosen, self.dest, value)
