"""C from the plant's compiled functions: one C function for each Python function, by its syntax tree.

So the equations of an FMU are those of epv_env/plant by construction. Only what such functions consist
of is known here: numbers, named tuples of numbers, arithmetic, comparisons, branches and fixed loops.
"""

import ast
import inspect
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from textwrap import dedent
from typing import Any

from training.deploy.fmu.c_expressions import (
    NUMBER,
    TRUTH,
    CFunction,
    Declarations,
    Expressions,
    Symbol,
    TranslationError,
    written,
)
from training.deploy.syntax import OPERATORS, syntax_tree


def definition(done: CFunction, arguments: dict[str, str], body: str) -> str:
    """A function's text; structures are passed by their address."""
    listed = ", ".join(
        f"{kind} {name}" if kind in (NUMBER, TRUTH) else f"const {kind} *{name}"
        for name, kind in arguments.items()
    )
    return f"static inline {done.result} {done.name}({listed})\n{{\n{body}}}\n"


class Body(Expressions):
    """One function on its way to C."""

    def __init__(self, known: Declarations, python: Callable[..., Any], types: tuple[str, ...]):
        tree = syntax_tree(python)
        self.tree = tree
        self.given = dict(zip((argument.arg for argument in tree.args.args), types, strict=True))
        names = [node for node in ast.walk(tree) if isinstance(node, ast.Name)]
        self.used = {node.id for node in names}
        assigned = {node.id for node in names if isinstance(node.ctx, ast.Store)}
        self.copied = {n: k for n, k in self.given.items() if n in assigned and k not in (NUMBER, TRUTH)}
        """Structures that the function changes: it does so to a copy."""
        super().__init__(known, python, {n: k for n, k in self.given.items() if n not in self.copied})
        self.locals = dict(self.copied)
        self.result: str | None = None

    def translated(self) -> tuple[str, CFunction]:
        """The function's text, and how to call it."""
        body = self.statements(self.tree.body, "    ")
        done = CFunction(name=self.python.__name__, result=self.result or "void")
        variables = "".join(
            f"    {kind} {name}{f' = *given_{name}' if name in self.copied else ''};\n"
            for name, kind in self.locals.items()
        )
        unused = "".join(f"    (void){name};\n" for name in self.arguments if name not in self.used)
        listed = {f"given_{n}" if n in self.copied else n: kind for n, kind in self.given.items()}
        return definition(done, listed, f"{variables}{unused}{body}"), done

    def statements(self, nodes: list[ast.stmt], margin: str) -> str:
        """C of statements, one or more lines for each."""
        return "".join(self.statement(node, margin) for node in nodes)

    def statement(self, node: ast.stmt, margin: str) -> str:
        """C of a statement."""
        match node:
            case ast.Expr(value=ast.Constant(value=str())):
                return ""  # the docstring
            case ast.Return(value=ast.expr() as value):
                return f"{margin}return {self.returned(value)};\n"
            case ast.Assign(targets=targets, value=value):
                return "".join(self.assigned(target, value, margin) for target in targets)
            case ast.AugAssign(target=ast.Name(id=name), op=op, value=value) if type(op) in OPERATORS:
                return f"{margin}{name} {OPERATORS[type(op)]}= {self.value(value)[0]};\n"
            case ast.If(test=test, body=body, orelse=other):
                text = f"{margin}if ({self.value(test)[0]}) {{\n{self.statements(body, margin + '    ')}"
                if other:
                    text += f"{margin}}} else {{\n{self.statements(other, margin + '    ')}"
                return f"{text}{margin}}}\n"
            case ast.For(
                target=ast.Name(id=name),
                iter=ast.Call(func=ast.Name(id="range"), args=[count]),
                body=body,
                orelse=[],
            ):
                until = float(self.value(count)[0])
                head = f"{margin}for (int {name} = 0; {name} < {until:.0f}; {name}++) {{\n"
                return f"{head}{self.statements(body, margin + '    ')}{margin}}}\n"
        self.refuse(node)

    def returned(self, value: ast.expr) -> str:
        """C of what is returned; remembers the type."""
        if isinstance(value, ast.Tuple):
            parts = [self.value(each) for each in value.elts]
            kind = self.translation.result(tuple(kind for _, kind in parts))
            text = f"({kind}){{{', '.join(text for text, _ in parts)}}}"
        else:
            text, kind = self.value(value)
        if self.result not in (None, kind):
            self.refuse(value)
        self.result = kind
        return text

    def assigned(self, target: ast.expr, value: ast.expr, margin: str) -> str:
        """C of an assignment to one name, or to several from a tuple or a function's values."""
        match target, value:
            case ast.Name(id=name), _:
                text, kind = self.value(value)
                return f"{margin}{self.variable(name, kind)} = {text};\n"
            case ast.Tuple(elts=targets), ast.Tuple(elts=values):
                names = {each.id for each in targets if isinstance(each, ast.Name)}
                if names & {node.id for node in ast.walk(value) if isinstance(node, ast.Name)}:
                    self.refuse(value)  # the values would have to be taken all at once
                pairs = zip(targets, values, strict=True)
                return "".join(self.assigned(each, one, margin) for each, one in pairs)
            case ast.Tuple(elts=targets), ast.Call():
                text, kind = self.value(value)
                inner = margin + "    "
                lines = [f"{inner}const {kind} parts = {text};\n"]
                for k, part in enumerate(self.translation.parts(kind)):
                    each = targets[k]
                    if not isinstance(each, ast.Name):
                        self.refuse(target)
                    lines.append(f"{inner}{self.variable(each.id, part)} = parts.part{k};\n")
                return f"{margin}{{\n{''.join(lines)}{margin}}}\n"
        self.refuse(target)

    def variable(self, name: str, kind: str) -> str:
        """A name that is assigned to, declared with its type at the top of the function."""
        known = self.arguments.get(name) or self.locals.setdefault(name, kind)
        if known != kind:
            raise TranslationError(
                f"{self.python.__name__} gives {name} values of two types: use two names"
            )
        return name


HELPERS = """\
static inline double lesser(double a, double b) { return a < b ? a : b; }
static inline double greater(double a, double b) { return a > b ? a : b; }
"""
"""What the translated functions call beside math.h."""


@dataclass(kw_only=True)
class Translation:
    """C of functions and of all that they call, each once, in an order in which C can read them."""

    structures: dict[type, str] = field(default_factory=dict)
    """C types by named tuple; a result of several values becomes a structure of its own."""
    texts: list[str] = field(default_factory=list)
    _functions: dict[tuple[Any, tuple[str, ...]], CFunction] = field(default_factory=dict)
    _results: dict[tuple[str, ...], str] = field(default_factory=dict)

    def structure(self, kind: type) -> str:
        """The C type of a named tuple of numbers, declared when it is first needed."""
        if kind not in self.structures:
            name = kind.__name__
            fields = "".join(f"    double {each};\n" for each in kind._fields)  # type: ignore[attr-defined]
            self.texts.append(f"typedef struct {{\n{fields}}} {name};\n")
            self.structures[kind] = name
        return self.structures[kind]

    def result(self, types: tuple[str, ...]) -> str:
        """The C type of several values that a function returns together, `part0` and so on."""
        if types not in self._results:
            name = f"parts_{len(self._results)}"
            fields = "".join(f"    {each} part{k};\n" for k, each in enumerate(types))
            self.texts.append(f"typedef struct {{\n{fields}}} {name};\n")
            self._results[types] = name
        return self._results[types]

    def parts(self, name: str) -> tuple[str, ...]:
        """Types of the values in a structure that `result` named. Raises KeyError for another one."""
        return {name: types for types, name in self._results.items()}[name]

    def function(self, function: Callable[..., Any], types: tuple[str, ...]) -> CFunction:
        """Translate a function whose arguments have these C types. Raises TranslationError."""
        python = getattr(function, "py_func", function)
        key = (python, types)
        if key not in self._functions:
            found = [done for (other, _), done in self._functions.items() if other is python]
            if found:
                raise TranslationError(
                    f"{python.__name__} is called with arguments of different types: C needs one"
                )
            from_text = python.__code__.co_filename == "<string>"
            text, self._functions[key] = (
                self._traced(python, types) if from_text else Body(self, python, types).translated()
            )
            self.texts.append(text)
        return self._functions[key]

    def _traced(self, python: Callable[..., Any], types: tuple[str, ...]) -> tuple[str, CFunction]:
        """C of a function that `primitives.generated` made from text: one expression, traced."""
        kinds = {name: kind for kind, name in self.structures.items()}
        names = list(inspect.signature(python).parameters)
        arguments = [
            kinds[kind](*(Symbol(f"{name}->{each}") for each in kinds[kind]._fields))  # type: ignore[attr-defined]
            if kind in kinds
            else Symbol(name)
            for name, kind in zip(names, types, strict=True)
        ]
        result = python(*arguments)
        kind = self.structures[type(result)]
        members = ",\n        ".join(f".{each} = {written(v)}" for each, v in result._asdict().items())
        taken = {known.name for known in self._functions.values()}
        name = python.__name__ if python.__name__ not in taken else f"{python.__name__}_{len(taken)}"
        done = CFunction(name=name, result=kind)
        return definition(
            done, dict(zip(names, types, strict=True)), f"    return ({kind}){{\n        {members}}};\n"
        ), done


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
