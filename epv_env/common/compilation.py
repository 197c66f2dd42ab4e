"""Says once, on stderr, that the plant is compiled: it takes a minute, and is then read from a cache."""

import multiprocessing
import sys
from functools import cache
from typing import Any

from numba.core import event

KERNELS = ("epv_env.", "controllers.", "identification.")
"""How the modules begin whose compilation is announced."""


class _Announcer(event.Listener):
    """Says it once, at the first function that no cache holds."""

    def __init__(self) -> None:
        self._silent = False

    def on_start(self, event: Any) -> None:
        """numba begins to compile a function."""
        function = getattr(event.data.get("dispatcher"), "py_func", None)
        module = getattr(function, "__module__", None) or ""  # None: generated from text
        if not self._silent and module.startswith(KERNELS):
            self._silent = True
            print("compiling for this machine: a minute or two, once", file=sys.stderr)

    def on_end(self, event: Any) -> None:
        """Nothing is said at the end."""


@cache
def announce_compilation() -> None:
    """From now on say when the first function is compiled; workers leave it to their parent."""
    if multiprocessing.parent_process() is None:
        event.register("numba:compile", _Announcer())
