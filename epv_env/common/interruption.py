"""Ctrl-C and SIGTERM: the command and all its worker processes end, without a traceback."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import active_children
from types import FrameType

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
