"""C of a controller's compiled functions: check of the sensors, valve learner, advice and rules.

The functions of controllers/sensor_check.py, valve_learner.py, pulse.py and knowledge.py work on one
valve. In C they are in single precision: all numbers are `real`, indices are whole numbers in it. A
record is a structure; the table of the plant and the settings of the pulses are constants.
"""

import ast
import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from textwrap import fill
from typing import Any

import numpy as np
from numpy.typing import NDArray

from training.deploy.translation import WHOLE, Body, CFunction, Translation, Typed

HELPERS = """\
typedef float real;
static real lesser(real a, real b) { return b < a ? b : a; }
static real greater(real a, real b) { return b > a ? b : a; }
static real squared(real a) { return a * a; }
"""
"""What the translated functions call beside math.h."""

MOST = 1e38
"""Largest constant in single precision: what is larger stands for no limit."""

REAL, ROW, PLANT, ARRAY = "real", "real *", "plant", "array"
"""Kinds of arguments: a number, an observation or inputs of a network, what is constant in C, and a
constant array with its length."""
VALVE, SENSES, READINGS = "epv_valve", "epv_senses", "epv_readings"
"""The same: records, passed by their address."""


def listed(values: NDArray) -> str:
    """Numbers of an array of any shape, row after row, as C writes them, on indented lines."""
    text = ", ".join(literal(value) for value in values.ravel())
    return f"\n{fill(text, 100, initial_indent='    ', subsequent_indent='    ')}\n"


def literal(value: float) -> str:
    """A float in C; nine digits give it back to the bit."""
    text = f"{value:.9g}"
    return f"{text}f" if any(mark in text for mark in ".e") else f"{text}.0f"


@dataclass(kw_only=True)
class ControllerC(Translation):
    """C of functions that work on a valve's record."""

    constants: Mapping[str, Mapping[str, Any]]
    """By the name of a constant argument: numbers, and arrays, by attribute."""
    shapes: Mapping[int, tuple[int, ...]]
    """Of arrays that are passed as arguments, by their number of indices beyond one."""
    indices: tuple[str, ...]
    """Names of arguments that are always 0 in C: the plant's place in the table."""
    records: Mapping[str, np.dtype]
    """By the name of the structure."""
    arrays: dict[str, NDArray] = field(default_factory=dict)
    """Constant arrays that the functions read, by name in C."""

    def translated(self, python: Callable[..., Any], types: tuple[str, ...]) -> tuple[str, CFunction]:
        """The text of a function, and how to call it."""
        return _Body(self, python, types).translated()

    def structure(self, name: str) -> str:
        """The structure of a record."""
        fields = "".join(
            f"    float {field}{f'[{kind.shape[0]}]' if kind.shape else ''};\n"
            for field, (kind, *_) in (self.records[name].fields or {}).items()
        )
        return f"typedef struct {{\n{fields}}} {name};\n"

    def sources(self) -> str:
        """The helpers, constant arrays, structures and functions."""
        arrays = "".join(
            f"static const real {name}[{values.size}] = {{{listed(values.astype(np.float32))}}};\n"
            for name, values in self.arrays.items()
        )
        return "\n".join([HELPERS, arrays, *self.texts])


class _Body(Body):
    """One function on its way to C."""

    c: ControllerC
    NUMBER = TRUTH = REAL
    PREFIX = "fn_"
    MATHEMATICS = {  # noqa: RUF012
        math.exp: "expf", math.log: "logf", math.sqrt: "sqrtf", np.log: "logf", np.sqrt: "sqrtf",
        np.exp: "expf", abs: "fabsf", min: "lesser", max: "greater", np.minimum: "lesser",
        np.maximum: "greater",
    }  # fmt: skip

    def declared(self, name: str) -> list[str]:
        """A valve by its address, an array with its length; constants are not passed."""
        kind = self.given[name]
        if kind == ARRAY:
            return [f"const real *{name}", f"int {name}_n"]
        if kind in self.c.records:
            return [f"{kind} *{name}"]
        return [] if kind == PLANT else [f"{kind} {name}"]

    def held(self, kind: str) -> str:
        """Whole numbers are held in a real."""
        return REAL if kind == WHOLE else kind

    def literal(self, value: float) -> str:
        """A float in C."""
        return literal(min(value, MOST))

    def power(self, base: ast.expr, exponent: ast.expr) -> str:
        """C of a square; other powers are not known."""
        if not (isinstance(exponent, ast.Constant) and exponent.value == 2):
            self.refuse(exponent)
        return f"squared({self.value(base)[0]})"

    def variable(self, name: str, kind: str) -> Typed:
        """C of an argument or a variable; the plant's place in the table is 0."""
        return ("0" if kind == PLANT and name in self.c.indices else name), kind

    def constant(self, node: ast.expr, value: Any) -> Typed:
        """C of a number, or the name of a constant array, which is defined at the top of the file."""
        if isinstance(value, np.number):
            value = float(value)
        if isinstance(value, tuple):
            value = np.array(value)
        if not isinstance(value, np.ndarray):
            return super().constant(node, value)
        known = [name for name, own in self.c.arrays.items() if own is value]
        if not known:
            module = self.python.__module__.rpartition(".")[2]
            known = [f"{module}_{ast.unparse(node).replace('.', '_').lstrip('_')}".upper()]
            self.c.arrays[known[0]] = value
        return known[0], ARRAY

    def meant(self, node: ast.expr) -> Any:
        """What an attribute of a constant argument, or a name outside of the function, stands for."""
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            holder = node.value.id
            if self.given.get(holder) == PLANT and holder in self.c.constants:
                return self.c.constants[holder][node.attr]
        return super().meant(node)

    def member(self, node: ast.Attribute, holder: str, attr: str) -> Typed:
        """C of an entry of a valve's record, or of a constant."""
        if self.given.get(holder) in self.c.records:
            return f"{holder}->{attr}", REAL
        return super().member(node, holder, attr)

    def entry(self, node: ast.expr, holder: ast.expr, index: ast.expr) -> Typed:
        """C of an entry of an array."""
        places = index.elts if isinstance(index, ast.Tuple) else [index]
        places = [p for p in places if ast.unparse(p) not in self.c.indices]
        if isinstance(holder, ast.Name) and self.given.get(holder.id) in (ARRAY, ROW):
            base, shape = holder.id, self.c.shapes.get(len(places), ())
        elif (
            isinstance(holder, ast.Attribute)
            and self.given.get(ast.unparse(holder.value)) in self.c.records
        ):
            base, shape = self.value(holder)[0], ()
        else:
            values = np.asarray(self.meant(holder), dtype=np.float64)
            if not places:  # one number of the plant
                return literal(float(values.ravel()[0])), REAL
            base, shape = self.value(holder)[0], values.shape
        flat = self.whole(places[0])
        for place, size in zip(places[1:], shape[1:], strict=True):
            flat = f"({flat} * {size} + {self.whole(place)})"
        return f"{base}[{flat}]", REAL

    def called(self, node: ast.Call, callee: Any) -> Typed:
        """C of a call: of an array's length, of `int`, or of another compiled function."""
        values = [self.value(each) for each in node.args]
        text = values[0][0] if values else ""
        if callee is len:
            return self.length(text), WHOLE
        if callee is int:
            return f"((real)(int)({text}))", REAL
        if not inspect.isfunction(getattr(callee, "py_func", callee)) or node.keywords:
            self.refuse(node)
        done = self.c.function(callee, tuple(self.held(kind) for _, kind in values))
        passed = []
        for text, kind in values:
            if kind != PLANT:
                passed.append(text)
            if kind == ARRAY:
                passed.append(self.length(text))
        return f"{done.name}({', '.join(passed)})", done.result

    def length(self, name: str) -> str:
        """Length of an array in C."""
        return f"{name}_n" if name in self.given else str(self.c.arrays[name].size)
