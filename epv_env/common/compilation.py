"""Says on stderr that functions are compiled: it takes half a minute, and is then read from a cache."""

import multiprocessing
import sys
from functools import cache
from typing import Any

from numba.core import event

KERNELS = ("epv_env.", "controllers.", "identification.")
"""How the modules begin whose compilation is announced."""


class Announcer(event.Listener):
    """Says it at the first function that a cache will keep; on a terminal it counts what is done."""

    def __init__(self) -> None:
        self._under_way = self._done = 0

    def on_start(self, event: Any) -> None:
        """numba begins to compile a function, perhaps for another one."""
        dispatcher = event.data["dispatcher"]
        kept = dispatcher.stats.cache_path is not None
        if self._under_way or (kept and (dispatcher.__module__ or "").startswith(KERNELS)):
            self._under_way += 1
            if self._under_way == 1 and not self._done:
                print("compiling for this machine: up to a minute, once", file=sys.stderr)

    def on_end(self, event: Any) -> None:
        """numba has compiled a function."""
        if self._under_way:
            self._under_way, self._done = self._under_way - 1, self._done + 1
            if sys.stderr.isatty():
                end = "" if self._under_way else "\n"
                print(f"\r{self._done} functions compiled", end=end, file=sys.stderr, flush=True)


@cache
def announce_compilation() -> None:
    """From now on say when the first function is compiled; workers leave it to their parent."""
    if multiprocessing.parent_process() is None:
        event.register("numba:compile", Announcer())
