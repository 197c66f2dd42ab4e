"""Options that several commands share, with the checks of their values."""

import argparse
from collections.abc import Callable
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
    add_number(parser, "--seed", kind=int, low=0, high=MOST["seed"], default=0, help=help)


def add_count(parser: argparse.ArgumentParser, option: str, *, default: int | None, help: str) -> None:
    """Add a whole number that is at least 1, such as --trials."""
    add_number(parser, option, kind=int, low=1, high=MOST_COUNTED, default=default, help=help)


def add_workers(parser: argparse.ArgumentParser) -> None:
    """Add --workers, the number of processes."""
    add_count(parser, "--workers", default=None, help="processes; default: all cores")


def add_number(
    parser: argparse.ArgumentParser,
    option: str,
    *,
    kind: Callable[[str], float],
    low: float,
    high: float,
    default: float | None = None,
    help: str,
) -> None:
    """Add a number from `low` to `high`; one outside ends the command with a sentence."""
    parser.add_argument(
        option, type=kind, action=_InRange, low=low, high=high, default=default, help=help
    )


class _InRange(argparse.Action):
    """Stores a number if it lies in its range."""

    def __init__(self, *args: Any, low: float, high: float, **options: Any):
        super().__init__(*args, **options)
        self.low, self.high = low, high

    def __call__(
        self, parser: argparse.ArgumentParser, options: argparse.Namespace, value: Any, name: Any = None
    ) -> None:
        if not self.low <= value <= self.high:  # true for NaN, too
            parser.error(f"{self.option_strings[0]} must be from {self.low:.10g} to {self.high:.10g}")
        setattr(options, self.dest, value)
