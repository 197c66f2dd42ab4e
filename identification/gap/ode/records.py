"""Records that a user's functions take: `x.v`, `u.throttle`, `p.friction`.

A function of records becomes a function of plain arrays, so that the same text runs with numbers, with
arrays of candidates, and compiled by numba.
"""

import keyword
from collections import namedtuple
from collections.abc import Callable, Sequence
from typing import Any

import numba

TIME = "t"
"""Field of the inputs that holds the time since the start of the run [s]."""


def record(kind: str, names: Sequence[str]) -> Any:
    """A class of records with these fields. Raises ValueError for names that Python cannot have."""
    for name in names:
        if not name.isidentifier() or keyword.iskeyword(name) or name.startswith("_"):
            raise ValueError(
                f"{kind} '{name}': the name is used as in `p.{name}`, so it must be a Python name: "
                "rename it with letters, digits and _"
            )
    double = sorted({name for name in names if list(names).count(name) > 1})
    if double:
        raise ValueError(f"{kind} '{double[0]}' is given twice: give every {kind} a name of its own")
    return namedtuple(kind.replace(" ", "_"), names)


class Records:
    """The records of one plant: states, inputs with the time, and parameters."""

    def __init__(self, states: Sequence[str], inputs: Sequence[str], symbols: Sequence[str]):
        self.states, self.inputs, self.symbols = tuple(states), tuple(inputs), tuple(symbols)
        self.x = record("state", self.states)
        self.u = record("input", (TIME, *self.inputs))
        self.p = record("parameter", self.symbols)

    def flat(self, function: Callable, count: int) -> Callable:
        """A function (x, t, u, p, out) of arrays that writes `count` results into `out`.

        The arrays' first axes are states, inputs, symbols and results; a second axis of candidates may
        follow. The text is generated, as numba needs every field written out.
        """
        x = ", ".join(f"x[{i}]" for i in range(len(self.states)))
        u = ", ".join(["t", *(f"u[{i}]" for i in range(len(self.inputs)))])
        p = ", ".join(f"p[{i}]" for i in range(len(self.symbols)))
        lines = [
            "def flat(x, t, u, p, out):",
            f"    r = function(State({x}), Input({u}), Parameter({p}))",
            *(f"    out[{i}] = r[{i}]" for i in range(count)),
            "    return out",
        ]
        names = {"function": function, "State": self.x, "Input": self.u, "Parameter": self.p}
        exec("\n".join(lines), names)
        return names["flat"]


def compiled(function: Callable) -> Callable:
    """The function compiled by numba; divisions by zero give inf, as in numpy."""
    return function if hasattr(function, "py_func") else numba.njit(error_model="numpy")(function)
