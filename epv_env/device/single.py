"""Steps whose rates of change are in single precision, from the functions that are there.

States are kept and summed in double precision, which a compensated sum of two single numbers imitates.
"""

from collections.abc import Callable
from types import CellType, FunctionType
from typing import Any

import numba
import numpy as np
from numba.core.dispatcher import Dispatcher

from epv_env.plant.effects.registry import Effects
from epv_env.plant.equations import Coefficients, Inputs, State, derivative
from epv_env.plant.primitives import generated
from epv_env.plant.stepping import try_step


def rebuilt(function: Any, change: Callable[[Any], Any], known: dict[Any, Any] | None = None) -> Any:
    """A compiled function, and all that it calls, with other values for the names and numbers in it.

    change: gives the other value, or the same for one that stays; a function that stays is rebuilt.
    """
    known = {} if known is None else known
    if function not in known:
        python = getattr(function, "py_func", function)
        code, names = python.__code__, python.__globals__

        def changed(value: Any) -> Any:
            other = change(value)
            calls = isinstance(value, (Dispatcher, FunctionType)) and other is value
            return rebuilt(value, change, known) if calls else other

        used = {name: changed(names[name]) for name in code.co_names if name in names}
        cells = tuple(CellType(changed(cell.cell_contents)) for cell in python.__closure__ or ())
        made = FunctionType(
            code.replace(co_consts=tuple(map(changed, code.co_consts))), {**names, **used},
            python.__name__, tuple(map(changed, python.__defaults__ or ())), cells,
        )  # fmt: skip
        known[function] = numba.jit(**getattr(function, "targetoptions", {}))(made)
    return known[function]


def _single(value: Any) -> Any:
    return np.float32(value) if isinstance(value, float) else value


def _narrowing(kind: Any) -> Any:
    fields = ", ".join(f"float32(q.{name})" for name in kind._fields)
    return generated("narrow", "q", f"return kind({fields})", kind=kind, float32=np.float32)


single_rates = rebuilt(derivative, _single)
"""`derivative` for arguments in single precision."""

_single_derivative = generated(
    "derivative",
    "q, u, c, effects, free_PV, free_MV, extended",
    "return rates(state(q), inputs(u), coefficients(c), sizes(effects), float32(free_PV), "
    "float32(free_MV), extended)",
    rates=single_rates, state=_narrowing(State), inputs=_narrowing(Inputs),
    coefficients=_narrowing(Coefficients), sizes=_narrowing(Effects), float32=np.float32,
)  # fmt: skip


def in_single(function: Any) -> Any:
    """A compiled function of the integrator with `derivative` in single precision."""
    return rebuilt(function, lambda value: _single_derivative if value is derivative else value)


single_try_step = in_single(try_step)
