"""What both translations to C share: a syntax tree, operators, and what names mean."""

import ast
import builtins
import inspect
from collections.abc import Callable
from textwrap import dedent
from typing import Any

OPERATORS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
COMPARISONS = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip


def syntax_tree(python: Callable[..., Any]) -> ast.FunctionDef:
    """The syntax tree of a function, from its source."""
    tree = ast.parse(dedent(inspect.getsource(python))).body[0]
    assert isinstance(tree, ast.FunctionDef)
    return tree


def meaning(node: ast.expr, python: Callable[..., Any]) -> Any:
    """What a name or attribute stands for outside of the function. Raises NameError, AttributeError."""
    names = {**vars(builtins), **python.__globals__}
    return eval(compile(ast.Expression(node), "<name>", "eval"), names)
