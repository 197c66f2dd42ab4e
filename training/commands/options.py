"""Options that comparison and sweep share."""

import argparse

from epv_env.common.command_line import SECONDS, add_plant, add_seed, add_workers


def add_episodes(parser: argparse.ArgumentParser, *, duration: float = 10.0) -> None:
    """--duration, --seed, --plant and --workers."""
    parser.add_argument("--duration", type=SECONDS, default=duration, help="of an episode [s]")
    add_seed(parser, help="of the first episode, within its range")
    add_plant(parser)
    add_workers(parser)
