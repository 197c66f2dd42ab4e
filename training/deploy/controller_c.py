"""C of a controller's compiled functions: valve learner, advice and rules, from their source.

The functions of controllers/valve_learner.py, pulse.py and knowledge.py work on one valve with plain
arithmetic. Each becomes one C function, by its syntax tree, in single precision: all numbers are `real`,
indices are whole numbers in it. A valve's record is a structure; the table of the plant and the settings
of the pulses are constants. What such functions do not hold is named and ends the export.
"""

import ast
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from textwrap import fill
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from training.deploy.syntax import COMPARISONS, OPERATORS, meaning, syntax_tree


class ExportError(ValueError):
    """A policy cannot be exported: the message says why and what to do."""


MATHEMATICS: dict[Any, str] = {
    math.exp: "expf", math.log: "logf", math.sqrt: "sqrtf", np.log: "logf", np.sqrt: "sqrtf",
    np.exp: "expf", abs: "fabsf", min: "lesser", max: "greater",
}  # fmt: skip
HELPERS = """\
typedef float real;
static real lesser(real a, real b) { return b < a ? b : a; }
static real greater(real a, real b) { return b > a ? b : a; }
static real squared(real a) { return a * a; }
"""
"""What the translated functions call beside math.h."""

MOST = 1e38
"""Largest constant in single precision: what is larger stands for no limit."""

REAL, VALVE, PLANT, ARRAY = "real", "valve", "plant", "array"
"""Kinds of arguments: a number, a valve's record, what is constant in C, and an array with its
length."""


def listed(values: NDArray) -> str:
    """Numbers of an array of any shape, row after row, as C writes them, on indented lines."""
    text = ", ".join(literal(value) for value in values.ravel())
    return f"\n{fill(text, 100, initial_indent='    ', subsequent_indent='    ')}\n"


def literal(value: float) -> str:
    """A float in C; nine digits give it back to the bit."""
    text = f"{value:.9g}"
    return f"{text}f" if any(mark in text for mark in ".e") else f"{text}.0f"


@dataclass(kw_only=True)
class Known:
    """What the translated functions take for granted."""

    constants: Mapping[str, Mapping[str, Any]]
    """By the name of a constant argument: numbers, and arrays, by attribute."""
    shapes: Mapping[int, tuple[int, ...]]
    """Of arrays that are passed as arguments, by their number of indices beyond one."""
    indices: tuple[str, ...]
    """Names of arguments that are always 0 in C: the plant's place in the table."""
    record: np.dtype
    """Of a valve."""


@dataclass(kw_only=True)
class ControllerC:
    """C of functions and of all that they call, each once, in an order in which C can read them."""

    known: Known
    texts: list[str] = field(default_factory=list)
    """Definitions of functions."""
    arrays: dict[str, NDArray] = field(default_factory=dict)
    """Constant arrays that the functions read, by name in C."""
    parts: set[int] = field(default_factory=set)
    """Numbers of values that functions return together: each has a structure."""
    _results: dict[Any, str] = field(default_factory=dict)

    def function(self, function: Callable[..., Any], kinds: tuple[str, ...]) -> str:
        """Translate a compiled function for arguments of these kinds; returns its result's C type.

        Raises ExportError for what has no form in C here.
        """
        python = getattr(function, "py_func", function)
        if python not in self._results:
            body = _Body(self, python, kinds)
            text = body.translated()
            self._results[python] = body.result
            self.texts.append(text)
        return self._results[python]

    def valve(self) -> str:
        """The structure of a valve's record."""
        fields = "".join(
            f"    float {name}{f'[{kind.shape[0]}]' if kind.shape else ''};\n"
            for name, (kind, *_) in (self.known.record.fields or {}).items()
        )
        return f"typedef struct {{\n{fields}}} epv_valve;\n"

    def sources(self) -> str:
        """The helpers, structures, constant arrays and functions."""
        structures = "".join(
            f"typedef struct {{ real a[{n}]; }} parts_{n};\n" for n in sorted(self.parts)
        )
        arrays = "".join(
            f"static const real {name}[{values.size}] = {{{listed(values.astype(np.float32))}}};\n"
            for name, values in self.arrays.items()
        )
        return "\n".join([HELPERS, structures, arrays, *self.texts])


class _Body:
    """One function on its way to C."""

    def __init__(self, c: ControllerC, python: Callable[..., Any], kinds: tuple[str, ...]):
        tree = syntax_tree(python)
        self.c, self.python, self.tree = c, python, tree
        self.given = dict(zip((each.arg for each in tree.args.args), kinds, strict=True))
        self.locals: dict[str, str] = {}
        """C types of variables."""
        self.result = "void"

    def refuse(self, node: ast.AST) -> NoReturn:
        """Raise ExportError for a piece of syntax."""
        raise ExportError(
            f"{self.python.__name__} holds {ast.unparse(node)!r}, which the export to C does not know: "
            "write it with arithmetic, branches and calls, or extend training/deploy/controller_c.py"
        )

    def translated(self) -> str:
        """The function's text."""
        body = self.block(self.tree.body, "    ")
        listed_arguments = []
        for name, kind in self.given.items():
            if kind == VALVE:
                listed_arguments.append(f"epv_valve *{name}")
            elif kind == ARRAY:
                constant = "" if self.writes(name) else "const "
                listed_arguments += [f"{constant}real *{name}", f"int {name}_n"]
            elif kind != PLANT:
                listed_arguments.append(f"{kind} {name}")
        variables = "".join(f"    {kind} {name};\n" for name, kind in self.locals.items())
        unused = "".join(
            f"    (void){name}{end};\n"
            for name, kind in self.given.items()
            if kind != PLANT
            for end in (("", "_n") if kind == ARRAY else ("",))
        )
        head = f"static {self.result} fn_{self.python.__name__}({', '.join(listed_arguments) or 'void'})"
        return f"{head}\n{{\n{variables}{unused}{body}}}\n"

    def writes(self, name: str) -> bool:
        """Whether the function writes into an array."""
        return any(
            isinstance(node, ast.Subscript)
            and isinstance(node.ctx, ast.Store)
            and ast.unparse(node.value) == name
            for node in ast.walk(self.tree)
        )

    def block(self, nodes: list[ast.stmt], margin: str) -> str:
        """C of statements."""
        return "".join(self.statement(node, margin) for node in nodes)

    def statement(self, node: ast.stmt, margin: str) -> str:
        """C of a statement, with its line end."""
        match node:
            case ast.Expr(value=ast.Constant(value=str())):
                return ""  # the docstring
            case ast.Expr(value=ast.Call() as call):
                return f"{margin}{self.value(call)};\n"
            case ast.Return(value=None):
                return f"{margin}return;\n"
            case ast.Return(value=ast.Tuple(elts=values)):
                self.result = self.parts(len(values))
                return f"{margin}return ({self.result}){{{{{', '.join(map(self.value, values))}}}}};\n"
            case ast.Return(value=ast.expr() as value):
                self.result = REAL
                return f"{margin}return {self.value(value)};\n"
            case ast.Assign(targets=[ast.Tuple(elts=targets)], value=value):
                return self.unpacked(targets, value, margin)
            case ast.Assign(targets=targets, value=value):
                chained = [self.target(each, value) for each in targets]
                return f"{margin}{' = '.join([*chained, self.value(value)])};\n"
            case ast.AugAssign(target=target, op=op, value=value) if type(op) in OPERATORS:
                return f"{margin}{self.target(target)} {OPERATORS[type(op)]}= {self.value(value)};\n"
            case ast.If(test=test, body=body, orelse=other):
                text = f"{margin}if ({self.truth(test)}) {{\n{self.block(body, margin + '    ')}"
                if other:
                    text += f"{margin}}} else {{\n{self.block(other, margin + '    ')}"
                return f"{text}{margin}}}\n"
            case ast.For(
                target=ast.Name(id=name), iter=ast.Call(func=ast.Name(id="range"), args=ends), body=body
            ):
                self.locals.setdefault(name, "int")
                low, high = ["0", *map(self.whole, ends)][-2:]
                head = f"{margin}for ({name} = {low}; {name} < {high}; {name}++) {{\n"
                return f"{head}{self.block(body, margin + '    ')}{margin}}}\n"
        self.refuse(node)

    def parts(self, count: int) -> str:
        """The structure of so many values."""
        self.c.parts.add(count)
        return f"parts_{count}"

    def unpacked(self, targets: list[ast.expr], value: ast.expr, margin: str) -> str:
        """C of an assignment to several targets: all values are taken before the first is assigned."""
        count, inner = len(targets), margin + "    "
        names = [self.target(each) for each in targets]
        kind = self.parts(count)
        if isinstance(value, ast.Tuple):
            taken = f"{{{{{', '.join(map(self.value, value.elts))}}}}}"
        else:
            taken = self.value(value)
        lines = "".join(f"{inner}{name} = taken.a[{k}];\n" for k, name in enumerate(names))
        return f"{margin}{{\n{inner}const {kind} taken = {taken};\n{lines}{margin}}}\n"

    def target(self, node: ast.expr, value: ast.expr | None = None) -> str:
        """C of what is assigned to; a name is declared at the top of the function."""
        if isinstance(node, ast.Name) and node.id not in self.given:
            self.locals.setdefault(node.id, self.kind_of(value))
            return node.id
        return self.value(node)

    def kind_of(self, value: ast.expr | None) -> str:
        """The C type of what a variable holds: a number, or several values of a function."""
        if isinstance(value, ast.Call) and hasattr(self.meant(value.func), "py_func"):
            self.value(value)
            return self.c.function(self.meant(value.func), self.kinds(value.args))
        return REAL

    def truth(self, node: ast.expr) -> str:
        """C of a condition, without brackets around the whole."""
        text = self.value(node)
        return text[1:-1] if text.startswith("(") and text.endswith(")") else text

    def value(self, node: ast.expr) -> str:
        """C of an expression."""
        match node:
            case ast.Constant(value=bool() as truth):
                return "1" if truth else "0"
            case ast.Constant(value=int() | float() as number):
                return literal(min(number, MOST))
            case ast.Name(id=name) if name in self.known_constants(PLANT):
                return "0"
            case ast.Name(id=name) if name in self.given or name in self.locals:
                return name
            case ast.Name():
                return self.number(node, self.meant(node))
            case ast.Attribute(value=ast.Name(id=name), attr=attr) if self.given.get(name) == VALVE:
                return f"{name}->{attr}"
            case ast.Attribute():
                return self.number(node, self.constant(node))
            case ast.Subscript(value=holder, slice=index):
                return self.entry(node, holder, index)
            case ast.BinOp(left=left, op=ast.Pow(), right=ast.Constant(value=2)):
                return f"squared({self.value(left)})"
            case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
                return f"({self.value(left)} {OPERATORS[type(op)]} {self.value(right)})"
            case ast.BoolOp(op=op, values=values):
                sign = " && " if isinstance(op, ast.And) else " || "
                return f"({sign.join(map(self.value, values))})"
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return f"(-{self.value(operand)})"
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return f"(!{self.value(operand)})"
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in COMPARISONS:
                return f"({self.value(left)} {COMPARISONS[type(op)]} {self.value(right)})"
            case ast.IfExp(test=test, body=body, orelse=other):
                return f"({self.value(test)} ? {self.value(body)} : {self.value(other)})"
            case ast.Call(func=function, args=arguments, keywords=[]):
                return self.called(node, self.meant(function), arguments)
        self.refuse(node)

    def known_constants(self, kind: str) -> set[str]:
        """Arguments of a kind that stand for 0 in C: the plant's place in the table."""
        return {name for name, own in self.given.items() if own == kind and name in self.c.known.indices}

    def constant(self, node: ast.expr) -> Any:
        """What an attribute of a constant argument, or a name outside of the function, stands for."""
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            holder = node.value.id
            if self.given.get(holder) == PLANT and holder in self.c.known.constants:
                return self.c.known.constants[holder][node.attr]
        return self.meant(node)

    def meant(self, node: ast.expr) -> Any:
        """What a name outside of the function stands for."""
        try:
            return meaning(node, self.python)
        except (NameError, AttributeError):
            self.refuse(node)

    def number(self, node: ast.expr, value: Any) -> str:
        """C of a constant number."""
        if isinstance(value, bool) or not isinstance(value, int | float | np.number):
            self.refuse(node)
        return literal(float(value))

    def array(self, node: ast.expr) -> tuple[str, int]:
        """Name in C of a constant array, and its length; it is defined at the top of the file."""
        values = self.constant(node)
        known = [name for name, own in self.c.arrays.items() if own is values]
        if not known:
            module = self.python.__module__.rpartition(".")[2]
            known = [f"{module}_{ast.unparse(node).replace('.', '_').lstrip('_')}".upper()]
            self.c.arrays[known[0]] = values
        return known[0], values.size

    def entry(self, node: ast.expr, holder: ast.expr, index: ast.expr) -> str:
        """C of an entry of an array."""
        places = index.elts if isinstance(index, ast.Tuple) else [index]
        places = [p for p in places if ast.unparse(p) not in self.c.known.indices]
        if isinstance(holder, ast.Name) and self.given.get(holder.id) == ARRAY:
            base, shape = holder.id, self.c.known.shapes.get(len(places), ())
        elif isinstance(holder, ast.Attribute) and self.given.get(ast.unparse(holder.value)) == VALVE:
            base, shape = self.value(holder), ()
        else:
            values = np.asarray(self.constant(holder), dtype=np.float64)
            if not places:  # one number of the plant
                return literal(float(values.ravel()[0]))
            base, shape = self.array(holder)[0], values.shape
        flat = self.whole(places[0])
        for place, size in zip(places[1:], shape[1:], strict=True):
            flat = f"({flat} * {size} + {self.whole(place)})"
        return f"{base}[{flat}]"

    def whole(self, node: ast.expr) -> str:
        """C of an expression as a whole number."""
        text = self.value(node)
        if text.removesuffix(".0f").isdigit():
            return text.removesuffix(".0f")
        return text if self.locals.get(text) == "int" else f"(int)({text})"

    def kinds(self, arguments: list[ast.expr]) -> tuple[str, ...]:
        """Kinds of a call's arguments."""
        found = []
        for each in arguments:
            if isinstance(each, ast.Call):
                found.append(self.kind_of(each))
                continue
            if isinstance(each, ast.Name) and (each.id in self.given or each.id in self.locals):
                kind = self.given.get(each.id) or self.locals[each.id]
                found.append(REAL if kind == "int" else kind)
                continue
            is_constant = isinstance(each, ast.Name | ast.Attribute) and not self.in_valve(each)
            held = self.constant(each) if is_constant else None
            found.append(ARRAY if isinstance(held, np.ndarray) else REAL)
        return tuple(found)

    def in_valve(self, node: ast.expr) -> bool:
        """Whether an expression is an entry of a valve's record."""
        return isinstance(node, ast.Attribute) and self.given.get(ast.unparse(node.value)) == VALVE

    def called(self, node: ast.expr, callee: Any, arguments: list[ast.expr]) -> str:
        """C of a call: of mathematics, of an array's length, or of another compiled function."""
        if callee is len and isinstance(arguments[0], ast.Name):
            own = arguments[0].id in self.given
            return f"{arguments[0].id}_n" if own else literal(len(self.constant(arguments[0])))
        if callee is int:
            return f"((real)(int)({self.value(arguments[0])}))"
        if callee in MATHEMATICS:
            return f"{MATHEMATICS[callee]}({', '.join(map(self.value, arguments))})"
        if not hasattr(callee, "py_func"):
            self.refuse(node)
        kinds = self.kinds(arguments)
        self.c.function(callee, kinds)
        passed = []
        for each, kind in zip(arguments, kinds, strict=True):
            if kind == ARRAY:
                own = isinstance(each, ast.Name) and each.id in self.given
                name, size = (each.id, f"{each.id}_n") if own else self.array(each)  # type: ignore[attr-defined]
                passed += [str(name), str(size)]
            elif kind != PLANT:
                passed.append(self.value(each))
        return f"fn_{callee.py_func.__name__}({', '.join(passed)})"
