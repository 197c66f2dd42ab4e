"""C of formulas in the parameters, and of the expressions in a function of the plant.

The formulas are the NumPy functions that fold parameters into the constants of the equations
(epv_env/plant/coefficients.py, the `value` of an effect's Constant). They have no branches but np.where:
they are evaluated once on symbols that write down what is done.
"""

import ast
import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NoReturn, Protocol

import numpy as np

from training.deploy.syntax import COMPARISONS, OPERATORS, meaning


class TranslationError(ValueError):
    """The plant holds something that has no counterpart in C here: the message says what and where."""


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
            raise TranslationError(f"np.{ufunc.__name__} has no form in C: add it to {__name__}.UFUNCS")
        return Symbol(UFUNCS[ufunc.__name__].format(*map(written, inputs)))

    def __array_function__(self, function: Any, types: Any, inputs: Any, options: Any) -> "Symbol":
        if function not in FUNCTIONS or options:
            raise TranslationError(
                f"np.{function.__name__} has no form in C: add it to {__name__}.FUNCTIONS"
            )
        return Symbol(FUNCTIONS[function].format(*map(written, inputs)))

    def astype(self, kind: type) -> "Symbol":
        """A truth value as a number."""
        assert kind is float
        return Symbol(f"(double){self.text}")


def written(value: Any) -> str:
    """A symbol or a number as C writes it."""
    return value.text if isinstance(value, Symbol) else repr(float(value))


NUMBER, TRUTH = "double", "int"
"""C types of numbers and of truth values; the other types are structures."""

JUNCTIONS = {ast.BitAnd: "&&", ast.BitOr: "||", ast.And: "&&", ast.Or: "||"}
BUILT_IN: dict[Any, str] = {min: "lesser", max: "greater", abs: "fabs"}
BUILT_IN |= {getattr(math, name): name for name in ("sqrt", "exp", "log", "log1p", "sin", "cos", "pow")}


@dataclass(frozen=True, kw_only=True)
class CFunction:
    """A translated function."""

    name: str
    result: str
    """Its C type."""


class Declarations(Protocol):
    """What is known of the other functions and of the structures: see `Translation`."""

    def structure(self, kind: type) -> str:
        """The C type of a named tuple of numbers."""
        ...

    def result(self, types: tuple[str, ...]) -> str:
        """The C type of several values that a function returns together."""
        ...

    def parts(self, name: str) -> tuple[str, ...]:
        """Types of the values in a structure that `result` named."""
        ...

    def function(self, function: Callable[..., Any], types: tuple[str, ...]) -> CFunction:
        """A translated function whose arguments have these C types."""
        ...


class Expressions:
    """The expressions of one function on its way to C."""

    def __init__(self, known: Declarations, python: Callable[..., Any], arguments: dict[str, str]):
        self.translation, self.python = known, python
        self.arguments = arguments
        """C types by name."""
        self.locals: dict[str, str] = {}
        """The same of variables."""

    def refuse(self, node: ast.AST) -> NoReturn:
        """Raise TranslationError for a piece of syntax."""
        raise TranslationError(
            f"{self.python.__name__} holds {ast.unparse(node)!r}, which the export to C does not know: "
            "write it with arithmetic, branches and calls, or extend training/deploy/fmu"
        )

    def value(self, node: ast.expr) -> tuple[str, str]:
        """C of an expression, and its type."""
        match node:
            case ast.Constant(value=bool() as truth):
                return ("1" if truth else "0"), TRUTH
            case ast.Constant(value=int() | float() as number):
                return repr(float(number)), NUMBER
            case ast.Name(id=name):
                return self.named(node, name)
            case ast.Attribute(value=ast.Name(id=name), attr=member):
                return f"{name}{'->' if name in self.arguments else '.'}{member}", NUMBER
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                return f"pow({self.value(left)[0]}, {self.value(right)[0]})", NUMBER
            case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
                return f"({self.value(left)[0]} {OPERATORS[type(op)]} {self.value(right)[0]})", NUMBER
            case ast.BinOp(left=left, op=op, right=right) if type(op) in JUNCTIONS:
                return f"({self.value(left)[0]} {JUNCTIONS[type(op)]} {self.value(right)[0]})", TRUTH
            case ast.BoolOp(op=op, values=values):
                return f"({f' {JUNCTIONS[type(op)]} '.join(self.value(v)[0] for v in values)})", TRUTH
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return f"(-{self.value(operand)[0]})", NUMBER
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return f"(!{self.value(operand)[0]})", TRUTH
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in COMPARISONS:
                sign = COMPARISONS[type(op)]
                return f"({self.value(left)[0]} {sign} {self.value(right)[0]})", TRUTH
            case ast.IfExp(test=test, body=body, orelse=other):
                first, kind = self.value(body)
                return f"({self.value(test)[0]} ? {first} : {self.value(other)[0]})", kind
            case ast.Call(func=function, args=arguments, keywords=keywords):
                return self.called(node, self.meant(function), arguments, keywords)
        self.refuse(node)

    def named(self, node: ast.expr, name: str) -> tuple[str, str]:
        """C of a name: an argument, a variable, or a constant of the module."""
        kind = self.arguments.get(name) or self.locals.get(name)
        if kind:
            return name, kind
        number = self.meant(node)
        if isinstance(number, bool) or not isinstance(number, int | float):
            self.refuse(node)
        return repr(float(number)), NUMBER

    def meant(self, node: ast.expr) -> Any:
        """What a name outside of the function stands for."""
        try:
            return meaning(node, self.python)
        except NameError:
            self.refuse(node)

    def called(
        self, node: ast.expr, callee: Any, given: list[ast.expr], named: list[ast.keyword]
    ) -> tuple[str, str]:
        """C of a call: of a built-in function, a named tuple, or another function of the plant."""
        values = [self.value(each) for each in given]
        keywords = {each.arg: self.value(each.value) for each in named}
        if callee in BUILT_IN and not keywords:
            return f"{BUILT_IN[callee]}({', '.join(text for text, _ in values)})", NUMBER
        if isinstance(callee, type) and hasattr(callee, "_fields"):
            kind = self.translation.structure(callee)
            items = dict(zip(callee._fields, values, strict=False)) | keywords  # type: ignore[attr-defined]
            members = ", ".join(f".{name} = {text}" for name, (text, _) in items.items())
            return f"({kind}){{{members}}}", kind
        if not hasattr(callee, "py_func"):
            self.refuse(node)
        return self.called_function(node, callee, values, keywords)

    def called_function(
        self,
        node: ast.expr,
        callee: Any,
        values: list[tuple[str, str]],
        keywords: dict[Any, tuple[str, str]],
    ) -> tuple[str, str]:
        """C of a call of another function, its defaults filled in."""
        parameters = list(inspect.signature(callee.py_func).parameters.values())
        for parameter in parameters[len(values) :]:
            default = (
                (repr(float(parameter.default)), NUMBER)
                if parameter.default is not parameter.empty
                else None
            )
            values.append(keywords.get(parameter.name) or default or ("", ""))
        if any(kind not in (NUMBER, TRUTH) and not text.isidentifier() for text, kind in values):
            self.refuse(node)  # C passes structures by their address, which only variables have
        done = self.translation.function(callee, tuple(kind for _, kind in values))
        passed = [
            text if kind in (NUMBER, TRUTH) or text in self.arguments else f"&{text}"
            for text, kind in values
        ]
        return f"{done.name}({', '.join(passed)})", done.result
