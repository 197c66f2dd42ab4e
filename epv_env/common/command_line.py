"""What the command lines share: errors as one sentence, interruptions, and the command to run next.

Ctrl-C and SIGTERM end a command and its worker processes without a traceback.
"""

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
    plant: Path | None = None
    """Its plant file; None: the report's calibration."""

    def command(self, program: str = "epv") -> str:
        """The line to paste into a shell."""
        plant = ("--plant", self.plant) if self.plant else ()
        return shlex.join([program, *map(str, (*self.words, *plant))])

    def __str__(self) -> str:
        """For a terminal, where `epv` is not on the path unless the environment is activated."""
        program = (
            "epv" if shutil.which("epv") else os.path.relpath(Path(sys.executable).with_name("epv"))
        )
        return f"next, {self.purpose}:\n    {self.command(program)}"


def beside(folder: Path, name: str) -> Path:
    """A folder for what the next command makes of this one: runs/ppo gives runs/ppo-NAME."""
    return folder.with_name(f"{folder.name}-{name}")
