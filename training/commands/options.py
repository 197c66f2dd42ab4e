"""Options that several commands share, with their checks."""

import argparse
from pathlib import Path

from epv_env.common.command_line import writable_folder
from epv_env.plant.valves import available_cores

MOST_COUNT = 10**9
"""Largest sensible number of episodes, trials or steps: what lies beyond is a slip, and would fail
late."""
MOST_SECONDS = 3600.0
"""Longest episode: the figures of a longer one fill the memory."""
MOST_SEED = 2**32 - 1
"""What NumPy's and torch's generators take."""


def count(text: str) -> int:
    """A whole number from 1 on, for argparse."""
    return _whole(text, 1, MOST_COUNT)


def seed(text: str) -> int:
    """A seed of random numbers, for argparse."""
    return _whole(text, 0, MOST_SEED)


def seconds(text: str) -> float:
    """A length of an episode [s], for argparse."""
    value = float(text)
    if not 0 < value <= MOST_SECONDS:
        raise argparse.ArgumentTypeError(f"{text} must lie above 0 and be at most {MOST_SECONDS:g}")
    return value


def _whole(text: str, least: int, most: int) -> int:
    value = int(text)
    if not least <= value <= most:
        raise argparse.ArgumentTypeError(f"{text} must be a whole number from {least} to {most}")
    return value


def add_folder(parser: argparse.ArgumentParser, default: str) -> None:
    """--out, the folder of results."""
    parser.add_argument(
        "--out",
        type=writable_folder,
        default=Path(default),
        help=f"folder of results (default: {default})",
    )


def add_episodes(parser: argparse.ArgumentParser, *, duration: float = 10.0) -> None:
    """--duration, --seed, --plant and --workers."""
    parser.add_argument("--duration", type=seconds, default=duration, help="of an episode [s]")
    parser.add_argument("--seed", type=seed, default=0, help="of the first episode, within its range")
    parser.add_argument("--plant", type=Path, help="plant file (default: the report's calibration)")
    parser.add_argument("--workers", type=count, default=available_cores(), help="processes")
