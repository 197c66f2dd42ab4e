"""What the command lines share: options, checked paths and numbers, and errors as one sentence.

Ctrl-C and SIGTERM end a command and its worker processes without a traceback.
"""

import argparse
import math
import os
import shlex
import shutil
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import active_children
from pathlib import Path
from types import FrameType

from epv_env.common.compilation import announce_compilation
from epv_env.common.extras import missing_package
from epv_env.common.files import check_writable

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interrupted(KeyboardInterrupt):
    """The user or the system asked the command to end; pools end their workers as on any Ctrl-C."""

    def __init__(self, number: int):
        """number: of the signal."""
        super().__init__(signal.Signals(number).name)
        self.status = 128 + number
        """Exit status of the command, as shells count it."""


@contextmanager
def interruptible() -> Iterator[None]:
    """Both signals raise Interrupted in the main thread; a second signal ends the process at once."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread receives signals
        return
    before = {number: signal.signal(number, _stop) for number in SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _stop(number: int, _frame: FrameType | None) -> None:
    for each in SIGNALS:
        signal.signal(each, signal.SIG_DFL)
    threading.excepthook = _silent
    for child in active_children():  # a pool that is left waits for them
        child.terminate()
    raise Interrupted(number)


def _silent(_: threading.ExceptHookArgs) -> None:
    """For threads that serve a pool and find its workers ended."""


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


@dataclass(frozen=True)
class NextStep:
    """The command to run after a command, or after reading its report."""

    purpose: str
    """What for, as in "to train a policy"."""
    words: tuple[object, ...]
    """The command's name and its arguments."""

    def command(self, program: str = "epv") -> str:
        """The line to paste into a shell."""
        return shlex.join([program, *map(str, self.words)])

    def __str__(self) -> str:
        """For a terminal, where `epv` is not on the path unless the environment is activated."""
        program = (
            "epv" if shutil.which("epv") else os.path.relpath(Path(sys.executable).with_name("epv"))
        )
        return f"next, {self.purpose}:\n    {self.command(program)}"


def plant_option(plant: Path | None) -> tuple[object, ...]:
    """--plant and its file, for the next command; nothing for the report's calibration."""
    return ("--plant", plant) if plant else ()


def beside(folder: Path, name: str) -> Path:
    """A folder for what the next command makes of this one: runs/ppo gives runs/ppo-NAME."""
    return folder.with_name(f"{folder.name}-{name}")


def writable_file(text: str) -> Path:
    """A path whose folder can be written, for argparse."""
    path = Path(text)
    writable_folder(str(path.parent))
    if path.is_dir():
        raise argparse.ArgumentTypeError(f"{path} is a folder: give the name of a file")
    try:
        check_writable(path)
    except OSError as error:
        raise argparse.ArgumentTypeError(f"{path}: {error.strerror}") from None
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


@dataclass(frozen=True)
class Number:
    """A number within a range, for argparse. What lies beyond is a slip, and would fail late."""

    kind: type[int] | type[float]
    low: float
    high: float

    def __call__(self, text: str) -> float:
        """The number. Raises ArgumentTypeError, with the range in its sentence."""
        try:
            value = self.kind(text)
        except ValueError:
            value = math.nan
        if not self.low <= value <= self.high:  # not true for NaN
            name = "whole number" if self.kind is int else "number"
            shown = text if len(text) < 40 else text[:40] + "..."
            span = f"from {self.low:.10g} to {self.high:.10g}"
            raise argparse.ArgumentTypeError(f"{shown} must be a {name} {span}")
        return value


COUNT = Number(int, 1, 10**9)
"""Episodes, trials or steps."""
SEED = Number(int, 0, 2**32 - 1)
"""What NumPy's and torch's generators take."""
SECONDS = Number(float, 1e-6, 3600.0)
"""Length of an episode [s]: the figures of a longer one than an hour fill the memory."""
JUDGED_SECONDS = Number(float, 0.55, SECONDS.high)
"""Length of an episode whose pressures are judged [s]: they count from 0.5 s on."""


def add_out(
    parser: argparse.ArgumentParser, default: str | None = None, *, help: str = "folder of results"
) -> None:
    """Add --out, a folder that exists or can be made; required unless there is a default."""
    parser.add_argument(
        "--out",
        type=writable_folder,
        default=default and Path(default),
        required=default is None,
        help=help,
    )


def add_plant(
    parser: argparse.ArgumentParser, *, help: str = "plant file (default: the report's calibration)"
) -> None:
    """Add --plant, a plant file."""
    parser.add_argument("--plant", type=Path, metavar="FILE", help=help)


def add_seed(parser: argparse.ArgumentParser, *, default: int = 0, help: str) -> None:
    """Add --seed; help: what the seed draws."""
    parser.add_argument("--seed", type=SEED, default=default, help=help)


def add_workers(parser: argparse.ArgumentParser) -> None:
    """Add --workers, the number of processes."""
    parser.add_argument("--workers", type=Number(int, 1, 1024), help="processes (default: all cores)")


def add_device(parser: argparse.ArgumentParser, *, help: str) -> None:
    """Add --device; help: what runs there."""
    parser.add_argument(
        "--device", choices=("cpu", "cuda"), default="cpu",
        help=f"{help}: the processor, or an NVIDIA accelerator (extra gpu)",
    )  # fmt: skip


def add_episodes(parser: argparse.ArgumentParser) -> None:
    """Add --duration, --seed, --plant, --workers and --device of the episodes that are compared."""
    parser.add_argument("--duration", type=JUDGED_SECONDS, default=10.0, help="of an episode [s]")
    add_seed(parser, help="of the first episode, within its range")
    add_plant(parser)
    add_workers(parser)
    add_device(parser, help="of the plants")
