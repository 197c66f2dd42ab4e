"""C from the plant's compiled functions: one C function for each Python function, by its syntax tree.

So the equations of an FMU are those of epv_env/plant by construction. Only what such functions consist
of is known here: numbers, named tuples of numbers, arithmetic, comparisons, branches and fixed loops.
"""

import ast
import inspect
import math
import textwrap
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NoReturn

from training.deploy.fmu.tracing import Symbol, TranslationError, written

NUMBER, TRUTH = "double", "int"
"""C types of numbers and of truth values; the other types are structures."""

OPERATORS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
COMPARISONS = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip
JUNCTIONS = {ast.BitAnd: "&&", ast.BitOr: "||", ast.And: "&&", ast.Or: "||"}
BUILT_IN: dict[Any, str] = {min: "lesser", max: "greater", abs: "fabs"}
BUILT_IN |= {getattr(math, name): name for name in ("sqrt", "exp", "log", "log1p", "sin", "cos", "pow")}

HELPERS = """\
static inline double lesser(double a, double b) { return a < b ? a : b; }
static inline double greater(double a, double b) { return a > b ? a : b; }
"""
"""What the translated functions call beside math.h."""


@dataclass(frozen=True, kw_only=True)
class CFunction:
    """A translated function."""

    name: str
    result: str
    """Its C type."""


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
                self._traced(python, types) if from_text else _Body(self, python, types).translated()
            )
            self.texts.append(text)
        return self._functions[key]

    def _traced(self, python: Callable[..., Any], types: tuple[str, ...]) -> tuple[str, CFunction]:
        """C of a function that primitives/compiled.py generated from text: one expression, traced."""
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
        return _definition(
            done, dict(zip(names, types, strict=True)), f"    return ({kind}){{\n        {members}}};\n"
        ), done


def _definition(done: CFunction, arguments: dict[str, str], body: str) -> str:
    """A function's text; structures are passed by their address."""
    listed = ", ".join(
        f"{kind} {name}" if kind in (NUMBER, TRUTH) else f"const {kind} *{name}"
        for name, kind in arguments.items()
    )
    return f"static inline {done.result} {done.name}({listed})\n{{\n{body}}}\n"


class _Body:
    """One function on its way to C."""

    def __init__(self, translation: Translation, python: Callable[..., Any], types: tuple[str, ...]):
        tree = ast.parse(textwrap.dedent(inspect.getsource(python))).body[0]
        assert isinstance(tree, ast.FunctionDef)
        self.translation, self.python, self.tree = translation, python, tree
        names = [argument.arg for argument in tree.args.args]
        self.arguments = dict(zip(names, types, strict=True))
        self.locals: dict[str, str] = {}
        assigned = {
            n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
        }
        self.copied = {
            name: kind
            for name, kind in self.arguments.items()
            if name in assigned and kind not in (NUMBER, TRUTH)
        }
        """Structures that the function changes: it does so to a copy."""
        self.result: str | None = None

    def translated(self) -> tuple[str, CFunction]:
        """The function's text, and how to call it."""
        given = self.arguments
        self.locals = dict(self.copied)
        self.arguments = {name: kind for name, kind in given.items() if name not in self.copied}
        body = self.statements(self.tree.body, "    ")
        done = CFunction(name=self.python.__name__, result=self.result or "void")
        variables = "".join(
            f"    {kind} {name}{f' = *given_{name}' if name in self.copied else ''};\n"
            for name, kind in self.locals.items()
        )
        used = {node.id for node in ast.walk(self.tree) if isinstance(node, ast.Name)}
        unused = "".join(f"    (void){name};\n" for name in self.arguments if name not in used)
        listed = {f"given_{n}" if n in self.copied else n: kind for n, kind in given.items()}
        return _definition(done, listed, f"{variables}{unused}{body}"), done

    def refuse(self, node: ast.AST) -> NoReturn:
        """Raise TranslationError for a piece of syntax."""
        raise TranslationError(
            f"{self.python.__name__} holds {ast.unparse(node)!r}, which the export to C does not know: "
            "write it with arithmetic, branches and calls, or extend training/deploy/fmu/translation.py"
        )

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
        names = {**vars(__import__("builtins")), **self.python.__globals__}
        try:
            return eval(compile(ast.Expression(node), "<name>", "eval"), names)
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
        return self.called_function(callee, values, keywords)

    def called_function(
        self, callee: Any, values: list[tuple[str, str]], keywords: dict[Any, tuple[str, str]]
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
        done = self.translation.function(callee, tuple(kind for _, kind in values))
        passed = [
            text if kind in (NUMBER, TRUTH) or text in self.arguments else f"&{text}"
            for text, kind in values
        ]
        return f"{done.name}({', '.join(passed)})", done.result
