"""C of compiled Python functions by their syntax trees, one C function for each.

Known is what such functions consist of: numbers, structures, arithmetic, comparisons, branches, loops
over a range, calls. What else they hold is named and ends the export. A dialect, which is subclasses of
`Body` and `Translation`, says what names, attributes and calls mean, and how arguments are passed.
"""

import ast
import builtins
import inspect
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from textwrap import dedent
from typing import Any, ClassVar, NoReturn

OPERATORS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
COMPARISONS = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip
JUNCTIONS = {ast.BitAnd: "&&", ast.BitOr: "||", ast.And: "&&", ast.Or: "||"}

WHOLE = "int"
"""C type of whole numbers."""

Typed = tuple[str, str]
"""An expression in C, and its type."""


class ExportError(ValueError):
    """Something cannot be exported: the message says why and what to do."""


@dataclass(frozen=True, kw_only=True)
class CFunction:
    """A translated function."""

    name: str
    result: str
    """Its C type."""


@dataclass(kw_only=True)
class Translation:
    """C of functions and of all that they call, each once, in an order in which C can read them."""

    texts: list[str] = field(default_factory=list)
    """Definitions of structures and functions."""
    functions: dict[Any, tuple[tuple[str, ...], CFunction]] = field(default_factory=dict)
    """C types of the arguments and translated function, by Python function."""
    results: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """C types of the values that a function returns together, by their structure."""

    def together(self, types: tuple[str, ...]) -> str:
        """The structure of several values, `part0` and so on, declared when it is first needed."""
        known = [name for name, parts in self.results.items() if parts == types]
        if known:
            return known[0]
        name = f"parts_{len(self.results)}"
        fields = "".join(f"    {each} part{k};\n" for k, each in enumerate(types))
        self.texts.append(f"typedef struct {{\n{fields}}} {name};\n")
        self.results[name] = types
        return name

    def function(self, function: Callable[..., Any], types: tuple[str, ...]) -> CFunction:
        """Translate a function whose arguments have these C types. Raises ExportError."""
        python = getattr(function, "py_func", function)
        if python not in self.functions:
            text, done = self.translated(python, types)
            self.texts.append(text)
            self.functions[python] = types, done
        known, done = self.functions[python]
        if known != types:
            raise ExportError(
                f"{python.__name__} is called with arguments of different types: C needs one"
            )
        return done

    def translated(self, python: Callable[..., Any], types: tuple[str, ...]) -> tuple[str, CFunction]:
        """The text of a function, and how to call it."""
        raise NotImplementedError


class Body:
    """One function on its way to C."""

    NUMBER: ClassVar[str]
    """C type of numbers."""
    TRUTH: ClassVar[str]
    """C type of truth values."""
    PREFIX: ClassVar[str] = ""
    """Of the functions' names in C."""
    MATHEMATICS: ClassVar[Mapping[Any, str]]
    """Names in C of built-in functions."""

    def __init__(self, c: Translation, python: Callable[..., Any], types: tuple[str, ...]):
        tree = ast.parse(dedent(inspect.getsource(python))).body[0]
        assert isinstance(tree, ast.FunctionDef)
        self.c, self.python, self.tree = c, python, tree
        self.given = dict(zip((each.arg for each in tree.args.args), types, strict=True))
        """C types of the arguments."""
        self.locals: dict[str, str] = {}
        """The same of variables."""
        self.result: str | None = None

    def refuse(self, node: ast.AST) -> NoReturn:
        """Raise ExportError for a piece of syntax."""
        raise ExportError(
            f"{self.python.__name__} holds {ast.unparse(node)!r}, which the export to C does not know: "
            "write it with arithmetic, branches and calls, or extend training/deploy/translation.py"
        )

    def translated(self) -> tuple[str, CFunction]:
        """The function's text, and how to call it."""
        body = self.block(self.tree.body, "    ")
        name = self.PREFIX + self.python.__name__
        taken = {known.name for _, known in self.c.functions.values()}
        unique = name if name not in taken else f"{name}_{len(taken)}"
        done = CFunction(name=unique, result=self.result or "void")
        passed = [declared for name in self.given for declared in self.declared(name)]
        variables = "".join(f"    {kind} {self.begun(name)};\n" for name, kind in self.locals.items())
        names = [each.rpartition(" ")[2].lstrip("*") for each in passed]
        unused = "".join(
            f"    (void){name};\n" for name in names if not re.search(rf"\b{name}\b", variables + body)
        )
        head = f"static inline {done.result} {done.name}({', '.join(passed) or 'void'})"
        return f"{head}\n{{\n{variables}{unused}{body}}}\n", done

    def declared(self, name: str) -> list[str]:
        """How an argument stands in the list of arguments; some stand there twice, or not at all."""
        return [f"{self.given[name]} {name}"]

    def begun(self, name: str) -> str:
        """How a variable is declared."""
        return name

    def block(self, nodes: list[ast.stmt], margin: str) -> str:
        """C of statements."""
        return "".join(self.statement(node, margin) for node in nodes)

    def statement(self, node: ast.stmt, margin: str) -> str:
        """C of a statement, with its line end."""
        match node:
            case ast.Expr(value=ast.Constant(value=str())):
                return ""  # the docstring
            case ast.Expr(value=ast.Call() as call):
                return f"{margin}{self.value(call)[0]};\n"
            case ast.Return(value=None):
                return f"{margin}return;\n"
            case ast.Return(value=ast.expr() as value):
                return f"{margin}return {self.returned(value)};\n"
            case ast.Assign(targets=[ast.Tuple(elts=targets)], value=value):
                return self.unpacked(targets, value, margin)
            case ast.Assign(targets=targets, value=value):
                text, kind = self.value(value)
                chained = [self.target(each, kind) for each in targets]
                return f"{margin}{' = '.join([*chained, text])};\n"
            case ast.AugAssign(target=target, op=op, value=value) if type(op) in OPERATORS:
                name = self.target(target, self.NUMBER)
                return f"{margin}{name} {OPERATORS[type(op)]}= {self.value(value)[0]};\n"
            case ast.If(test=test, body=body, orelse=other):
                text = f"{margin}if ({self.condition(test)}) {{\n{self.block(body, margin + '    ')}"
                if other:
                    text += f"{margin}}} else {{\n{self.block(other, margin + '    ')}"
                return f"{text}{margin}}}\n"
            case ast.For(
                target=ast.Name(id=name), iter=ast.Call(func=ast.Name(id="range"), args=ends), body=body
            ):
                self.locals.setdefault(name, WHOLE)
                low, high = ["0", *map(self.whole, ends)][-2:]
                head = f"{margin}for ({name} = {low}; {name} < {high}; {name}++) {{\n"
                return f"{head}{self.block(body, margin + '    ')}{margin}}}\n"
        self.refuse(node)

    def returned(self, value: ast.expr) -> str:
        """C of what is returned; remembers the type."""
        text, kind = self.taken(value)
        if self.result not in (None, kind):
            self.refuse(value)
        self.result = kind
        return f"({kind}){text}" if isinstance(value, ast.Tuple) else text

    def taken(self, value: ast.expr) -> Typed:
        """C of a value, or of several as the initialiser of a structure; and the type that holds it."""
        if not isinstance(value, ast.Tuple):
            text, kind = self.value(value)
            return text, self.held(kind)
        parts = [self.value(each) for each in value.elts]
        kind = self.c.together(tuple(self.held(kind) for _, kind in parts))
        return f"{{{', '.join(text for text, _ in parts)}}}", kind

    def held(self, kind: str) -> str:
        """The C type of a variable for values of a type."""
        return kind

    def unpacked(self, targets: list[ast.expr], value: ast.expr, margin: str) -> str:
        """C of an assignment to several targets: all values are taken before the first is assigned."""
        text, kind = self.taken(value)
        if kind not in self.c.results:
            self.refuse(value)
        inner, lines = margin + "    ", ""
        for k, (each, part) in enumerate(zip(targets, self.c.results[kind], strict=True)):
            lines += f"{inner}{self.target(each, part)} = taken.part{k};\n"
        return f"{margin}{{\n{inner}const {kind} taken = {text};\n{lines}{margin}}}\n"

    def target(self, node: ast.expr, kind: str) -> str:
        """C of what is assigned to; a name is declared at the top of the function."""
        if not isinstance(node, ast.Name):
            return self.value(node)[0]
        known = self.given.get(node.id) or self.locals.setdefault(node.id, self.held(kind))
        if known not in (kind, self.held(kind)):
            raise ExportError(
                f"{self.python.__name__} gives {node.id} values of two types: use two names"
            )
        return node.id

    def condition(self, node: ast.expr) -> str:
        """C of a condition, without brackets around the whole."""
        text = self.value(node)[0]
        return text[1:-1] if text.startswith("(") and text.endswith(")") else text

    def whole(self, node: ast.expr) -> str:
        """C of an expression as a whole number."""
        text, kind = self.value(node)
        digits = text.removesuffix("f").removesuffix(".0")
        if digits.isdigit():
            return digits
        return text if kind == WHOLE else f"(int)({text})"

    def literal(self, value: float) -> str:
        """A number as C writes it."""
        raise NotImplementedError

    def value(self, node: ast.expr) -> Typed:
        """C of an expression, and its type."""
        match node:
            case ast.Constant(value=bool() as truth):
                return ("1" if truth else "0"), self.TRUTH
            case ast.Constant(value=int() | float() as number):
                return self.literal(number), self.NUMBER
            case ast.Name(id=name) if kind := self.given.get(name) or self.locals.get(name):
                return self.variable(name, kind)
            case ast.Name():
                return self.constant(node, self.meant(node))
            case ast.Attribute(value=ast.Name(id=holder), attr=attr):
                return self.member(node, holder, attr)
            case ast.Subscript(value=holder, slice=index):
                return self.entry(node, holder, index)
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                return self.power(left, right), self.NUMBER
            case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
                return self.joined(OPERATORS[type(op)], left, right), self.NUMBER
            case ast.BinOp(left=left, op=op, right=right) if type(op) in JUNCTIONS:
                return self.joined(JUNCTIONS[type(op)], left, right), self.TRUTH
            case ast.BoolOp(op=op, values=values):
                return self.joined(JUNCTIONS[type(op)], *values), self.TRUTH
            case ast.Compare(left=left, ops=[ast.IsNot()], comparators=[ast.Constant(value=None)]):
                return self.condition(left), self.TRUTH
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in COMPARISONS:
                return self.joined(COMPARISONS[type(op)], left, right), self.TRUTH
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return f"(-{self.value(operand)[0]})", self.NUMBER
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return f"(!{self.value(operand)[0]})", self.TRUTH
            case ast.IfExp(test=test, body=body, orelse=other):
                first, kind = self.value(body)
                return f"({self.value(test)[0]} ? {first} : {self.value(other)[0]})", kind
            case ast.Call(func=function, args=arguments):
                callee = self.meant(function)
                if callee in self.MATHEMATICS and not node.keywords:
                    texts = [self.value(each)[0] for each in arguments]
                    return f"{self.MATHEMATICS[callee]}({', '.join(texts)})", self.NUMBER
                return self.called(node, callee)
        self.refuse(node)

    def joined(self, sign: str, *operands: ast.expr) -> str:
        """C of operands with an operator between them."""
        return f"({f' {sign} '.join(self.value(each)[0] for each in operands)})"

    def variable(self, name: str, kind: str) -> Typed:
        """C of an argument or a variable."""
        return name, kind

    def meant(self, node: ast.expr) -> Any:
        """What a name or attribute stands for outside of the function."""
        names = {**vars(builtins), **self.python.__globals__}
        try:
            return eval(compile(ast.Expression(node), "<name>", "eval"), names)
        except (NameError, AttributeError):
            self.refuse(node)

    def constant(self, node: ast.expr, value: Any) -> Typed:
        """C of a constant that stands outside of the function."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.refuse(node)
        return self.literal(float(value)), self.NUMBER

    def member(self, node: ast.Attribute, holder: str, attr: str) -> Typed:
        """C of an attribute."""
        return self.constant(node, self.meant(node))

    def entry(self, node: ast.expr, holder: ast.expr, index: ast.expr) -> Typed:
        """C of an entry of an array; there is none."""
        self.refuse(node)

    def power(self, base: ast.expr, exponent: ast.expr) -> str:
        """C of a power."""
        return f"pow({self.value(base)[0]}, {self.value(exponent)[0]})"

    def called(self, node: ast.Call, callee: Any) -> Typed:
        """C of a call that is no mathematics."""
        raise NotImplementedError
