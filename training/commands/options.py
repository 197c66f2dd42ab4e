"""Options that commands share."""

import argparse

from epv_env.common.command_line import SECONDS, add_plant, add_seed, add_workers


def add_device(parser: argparse.ArgumentParser, *, help: str) -> None:
    """--device; help: what runs there."""
    parser.add_argument(
        "--device", choices=("cpu", "cuda"), default="cpu",
        help=f"{help}: the processor, or an NVIDIA accelerator (extra gpu)",
    )  # fmt: skip


def add_episodes(parser: argparse.ArgumentParser, *, duration: float = 10.0) -> None:
    """--duration, --seed, --plant, --workers and --device."""
    parser.add_argument("--duration", type=SECONDS, default=duration, help="of an episode [s]")
    add_seed(parser, help="of the first episode, within its range")
    add_plant(parser)
    add_workers(parser)
    add_device(parser, help="of the plants")
