"""C of formulas in the parameters.

The formulas are the NumPy functions that fold parameters into the constants of the equations
(epv_env/plant/coefficients.py, the `value` of an effect's Constant). They have no branches but np.where:
they are evaluated once on symbols that write down what is done.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from training.deploy.translation import ExportError

UFUNCS: dict[str, str] = {
    "add": "({} + {})", "subtract": "({} - {})", "multiply": "({} * {})", "divide": "({} / {})",
    "power": "pow({}, {})", "negative": "(-{})", "sqrt": "sqrt({})", "abs": "fabs({})",
    "maximum": "greater({}, {})", "minimum": "lesser({}, {})",
    "sign": "(double)(({0} > 0.0) - ({0} < 0.0))",
    "less": "({} < {})", "less_equal": "({} <= {})", "greater": "({} > {})",
    "greater_equal": "({} >= {})", "equal": "({} == {})", "not_equal": "({} != {})",
}  # fmt: skip
"""C by NumPy's name of an operation, element by element."""

FUNCTIONS: dict[Callable[..., Any], str] = {np.where: "({} ? {} : {})", np.full_like: "{1}"}
"""C by NumPy function."""


@dataclass(frozen=True, eq=False)
class Symbol(np.lib.mixins.NDArrayOperatorsMixin):
    """A number that is known only when the FMU runs: its text in C."""

    text: str

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **_: Any) -> "Symbol":
        if method != "__call__" or ufunc.__name__ not in UFUNCS:
            raise ExportError(f"np.{ufunc.__name__} has no form in C: add it to {__name__}.UFUNCS")
        return Symbol(UFUNCS[ufunc.__name__].format(*map(written, inputs)))

    def __array_function__(self, function: Any, types: Any, inputs: Any, options: Any) -> "Symbol":
        if function not in FUNCTIONS or options:
            raise ExportError(f"np.{function.__name__} has no form in C: add it to {__name__}.FUNCTIONS")
        return Symbol(FUNCTIONS[function].format(*map(written, inputs)))

    def astype(self, kind: type) -> "Symbol":
        """A truth value as a number."""
        assert kind is float
        return Symbol(f"(double){self.text}")


def written(value: Any) -> str:
    """A symbol or a number as C writes it."""
    return value.text if isinstance(value, Symbol) else repr(float(value))
