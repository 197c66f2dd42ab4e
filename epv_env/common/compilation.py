"""Says on stderr when the plant is compiled, which takes a minute once and is then read from a cache."""

import sys
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
        if not self._silent and getattr(function, "__module__", "").startswith(KERNELS):
            self._silent = True
            print("compiling for this machine: a minute or two, once", file=sys.stderr)

    def on_end(self, event: Any) -> None:
        """Nothing is said at the end."""


def announce_compilation() -> None:
    """From now on say when the first function is compiled."""
    event.register("numba:compile", _Announcer())
