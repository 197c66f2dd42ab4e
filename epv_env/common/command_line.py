"""What the command lines share: checked paths and numbers, --quick, and errors as one sentence.

Ctrl-C and SIGTERM end a command and its worker processes without a traceback. A first run says that the
plant is compiled, which takes a minute once and is then read from a cache.
"""

import argparse
import math
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from multiprocessing import active_children
from pathlib import Path
from types import FrameType
from typing import Any

from numba.core import event

from epv_env.common.extras import missing_package

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


def ignore_interrupts() -> None:
    """For worker processes: a Ctrl-C in the terminal reaches them too, and their parent ends them."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


KERNELS = ("epv_env.", "controllers.", "identification.")
"""How the modules begin whose compilation is announced."""


class _Announcer(event.Listener):
    """Says it once, at the first function that no cache holds."""

    def __init__(self) -> None:
        self._silent = False

    def on_start(self, event: Any) -> None:
        """numba begins to compile a function."""
        function = getattr(event.data.get("dispatcher"), "py_func", None)
        if not self._silent and getattr(function, "__module__", "").startswith(KERNELS):
            self._silent = True
            print("compiling for this machine: a minute or two, once", file=sys.stderr)

    def on_end(self, event: Any) -> None:
        """Nothing is said at the end."""


def announce_compilation() -> None:
    """From now on say when the first function is compiled."""
    event.register("numba:compile", _Announcer())


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
