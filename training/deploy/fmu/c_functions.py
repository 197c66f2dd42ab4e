"""C from the plant's functions, so that the equations of an FMU are those of epv_env/plant.

Compiled functions are translated by their syntax. The NumPy formulas that fold parameters into the
constants of the equations (epv_env/plant/coefficients.py, the `value` of an effect's Constant) have no
branches but np.where: they are evaluated once on symbols that write down what is done.
"""

import ast
import inspect
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from textwrap import dedent
from typing import Any

import numpy as np

from training.deploy.translation import Body, CFunction, ExportError, Translation, Typed

NUMBER, TRUTH = "double", "int"
"""C types of numbers and of truth values; the other types are structures, passed by their address."""

HELPERS = """\
static inline double lesser(double a, double b) { return a < b ? a : b; }
static inline double greater(double a, double b) { return a > b ? a : b; }
"""
"""What the translated functions call beside math.h."""


@dataclass(kw_only=True)
class PlantC(Translation):
    """C of functions of numbers and named tuples of numbers."""

    structures: dict[type, str] = field(default_factory=dict)
    """C types by named tuple."""

    def structure(self, kind: type) -> str:
        """The C type of a named tuple of numbers, declared when it is first needed."""
        if kind not in self.structures:
            name = kind.__name__
            fields = "".join(f"    double {each};\n" for each in kind._fields)  # type: ignore[attr-defined]
            self.texts.append(f"typedef struct {{\n{fields}}} {name};\n")
            self.structures[kind] = name
        return self.structures[kind]

    def translated(self, python: Callable[..., Any], types: tuple[str, ...]) -> tuple[str, CFunction]:
        """The text of a function, and how to call it."""
        return _PlantBody(self, python, types).translated()


def _declared(name: str, kind: str) -> str:
    """An argument of a function."""
    return f"{kind} {name}" if kind in (NUMBER, TRUTH) else f"const {kind} *{name}"


class _PlantBody(Body):
    """One function on its way to C."""

    c: PlantC
    NUMBER, TRUTH = NUMBER, TRUTH
    MATHEMATICS = {  # noqa: RUF012
        min: "lesser", max: "greater", abs: "fabs",
        **{getattr(math, name): name for name in ("sqrt", "exp", "log", "log1p", "sin", "cos", "pow")},
    }  # fmt: skip

    def __init__(self, c: PlantC, python: Callable[..., Any], types: tuple[str, ...]):
        super().__init__(c, python, types)
        assigned = {
            node.id
            for node in ast.walk(self.tree)
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
        }
        self.copied = {n: k for n, k in self.given.items() if n in assigned and k not in (NUMBER, TRUTH)}
        """Structures that the function changes: it does so to a copy."""
        self.locals = dict(self.copied)

    def declared(self, name: str) -> list[str]:
        """How an argument stands in the list of arguments."""
        return [_declared(f"given_{name}" if name in self.copied else name, self.given[name])]

    def begun(self, name: str) -> str:
        """How a variable is declared; a copy of an argument at its value."""
        return f"{name} = *given_{name}" if name in self.copied else name

    def literal(self, value: float) -> str:
        """A double in C."""
        return repr(float(value))

    def passed_by_address(self, name: str) -> bool:
        """Whether a name is a structure that the function was given."""
        return name in self.given and name not in self.copied

    def member(self, node: ast.Attribute, holder: str, attr: str) -> Typed:
        """C of a field of a structure."""
        return f"{holder}{'->' if self.passed_by_address(holder) else '.'}{attr}", NUMBER

    def called(self, node: ast.Call, callee: Any) -> Typed:
        """C of a call of a named tuple, or of another function of the plant."""
        values = [self.value(each) for each in node.args]
        keywords = {each.arg: self.value(each.value) for each in node.keywords}
        if isinstance(callee, type) and hasattr(callee, "_fields"):
            kind = self.c.structure(callee)
            items = dict(zip(callee._fields, values, strict=False)) | keywords  # type: ignore[attr-defined]
            members = ", ".join(f".{name} = {text}" for name, (text, _) in items.items())
            return f"({kind}){{{members}}}", kind
        if not inspect.isfunction(callee):
            self.refuse(node)
        parameters = list(inspect.signature(callee).parameters.values())
        for parameter in parameters[len(values) :]:
            default = 0.0 if parameter.default is parameter.empty else parameter.default
            values.append(keywords.get(parameter.name) or (self.literal(default), NUMBER))
        if any(kind not in (NUMBER, TRUTH) and not text.isidentifier() for text, kind in values):
            self.refuse(node)  # C passes structures by their address, which only variables have
        done = self.c.function(callee, tuple(kind for _, kind in values))
        passed = [
            text if kind in (NUMBER, TRUTH) or self.passed_by_address(text) else f"&{text}"
            for text, kind in values
        ]
        return f"{done.name}({', '.join(passed)})", done.result


def field_texts(kind: type) -> dict[str, tuple[str, str]]:
    """Unit and meaning of each field of a named tuple, from the text below it."""
    tree = ast.parse(dedent(inspect.getsource(kind))).body[0]
    assert isinstance(tree, ast.ClassDef)
    found: dict[str, tuple[str, str]] = {}
    for node, below in zip(tree.body, tree.body[1:], strict=False):
        if isinstance(node, ast.AnnAssign) and isinstance(below, ast.Expr):
            assert isinstance(node.target, ast.Name)
            assert isinstance(below.value, ast.Constant)
            text = " ".join(str(below.value.value).split())
            unit = re.search(r"\[([^\]]+)\]", text)
            assert unit is not None, f"{kind.__name__}.{node.target.id} has no unit in its docstring"
            found[node.target.id] = ({"-": "1"}.get(unit[1], unit[1].split(" absolute")[0]), text)
    return found


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
