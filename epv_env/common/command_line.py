"""What the command lines share: checked paths and numbers, --quick, and errors as one sentence."""

import argparse
import math
import os
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from epv_env.common.compilation import announce_compilation
from epv_env.common.extras import missing_package
from epv_env.common.interruption import Interrupted, interruptible


def fail_clearly(main: Callable[[], int]) -> int:
    """Run a command; a ValueError or OSError becomes one sentence on stderr and exit status 2.

    Ctrl-C and SIGTERM end the command and its workers, with a sentence and status 130 or 143.
    """
    try:
        with interruptible():
            announce_compilation()
            return main()
    except ModuleNotFoundError as error:
        sentence = missing_package(error.name or "")
        if sentence is None:
            raise
        print(f"error: {sentence}", file=sys.stderr)
        return 2
    except (ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except Interrupted as interruption:
        print("interrupted: what was finished is kept", file=sys.stderr)
        return interruption.status


def writable_file(text: str) -> Path:
    """A path whose folder can be written, for argparse."""
    path = Path(text)
    writable_folder(str(path.parent))
    if path.is_dir():
        raise argparse.ArgumentTypeError(f"{path} is a folder: give the name of a file")
    return path


def writable_folder(text: str) -> Path:
    """A path at which a folder exists or can be made and written, for argparse."""
    path = Path(text)
    existing = path.absolute()
    while not existing.exists():
        existing = existing.parent
    if not existing.is_dir():
        raise argparse.ArgumentTypeError(f"{existing} is not a folder: choose another path")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise argparse.ArgumentTypeError(f"{existing} cannot be written: choose another path")
    return path


def parse_with_quick(
    parser: argparse.ArgumentParser, arguments: list[str] | None, quick: Mapping[str, Any]
) -> argparse.Namespace:
    """The options. With --quick, `quick` are the defaults: what is given beside it still holds."""
    parser.add_argument("--quick", action="store_true", help="a short run that shows that all works")
    if parser.parse_known_args(arguments)[0].quick:
        parser.set_defaults(**quick)
    return parser.parse_args(arguments)


MOST = {
    "workers": 1024,  # more processes than a machine has cores
    "duration": 3600.0,  # [s] an episode's traces of an hour fill the memory
    "seconds": 3600.0,  # [s] the same for a film
    "episodes": 1_000_000,  # their results fill the memory; and seeds end where others' begin
    **dict.fromkeys(("named", "random", "bound", "tuning", "joint_episodes", "screened"), 1_000_000),
    "seeds": 1000,  # trainings
    "recurrent_seeds": 1000,
    "end_to_end_seeds": 1000,
    "generations": 10_000,
    "seed": 2**32 - 1,  # what NumPy's and torch's generators take
    "switching_price": 1000.0,  # a switching would cost more than any excursion
    "timesteps": 10**12,  # years
    "recurrent_timesteps": 10**12,
    "end_to_end_timesteps": 10**12,
    "trials": 1_000_000,
    "decisions": 10**9,
    "rate": 1e7,  # [Hz] no bench samples pressures faster
}
"""Largest sensible values of options by name: what lies beyond is a slip, and would fail late."""


def check_positive(parser: argparse.ArgumentParser, chosen: argparse.Namespace, *names: str) -> None:
    """End with one sentence unless each of these numbers is above 0 and sensible (MOST), or None."""
    for name in names:
        value = getattr(chosen, name)
        if value is not None and not 0 < value < math.inf:
            parser.error(f"--{name.replace('_', '-')} must be positive and finite")
        _check_most(parser, name, value)


def check_not_negative(parser: argparse.ArgumentParser, chosen: argparse.Namespace, *names: str) -> None:
    """End with one sentence unless each of these numbers is at least 0 and sensible (MOST)."""
    for name in names:
        value = getattr(chosen, name)
        if value < 0:
            parser.error(f"--{name.replace('_', '-')} must not be negative")
        if not value < math.inf:
            parser.error(f"--{name.replace('_', '-')} must be finite")
        _check_most(parser, name, value)


def _check_most(parser: argparse.ArgumentParser, name: str, value: float | None) -> None:
    most = MOST.get(name, math.inf)
    if value is not None and value > most:
        parser.error(f"--{name.replace('_', '-')} must be at most {most:.10g}")
