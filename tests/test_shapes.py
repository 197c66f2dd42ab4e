"""Array functions say the shapes of their arrays."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("epv_env", "identification", "controllers", "training")

SHAPE = re.compile(r"\(\w[\w +*/.-]*,[^()]*\)|like `|shape", re.IGNORECASE)
"""A shape such as (n,) or (runs, samples), or the name of what has the same shape."""

WITHOUT_SHAPE = 0.05
"""Largest share of array functions that may leave the shape out: their array is obvious."""


def array_functions(source: str) -> Iterator[tuple[str, str]]:
    """Public functions and methods of a file that take or return an array: name and docstring."""
    waiting: list[tuple[str, ast.stmt]] = [("", node) for node in ast.parse(source).body]
    while waiting:
        prefix, node = waiting.pop()
        if not isinstance(node, ast.FunctionDef | ast.ClassDef) or node.name.startswith("_"):
            continue
        if isinstance(node, ast.ClassDef):
            waiting += [(f"{prefix}{node.name}.", child) for child in node.body]
        elif re.search("NDArray|ArrayLike", ast.unparse(node.args) + _returned(node)):
            yield prefix + node.name, ast.get_docstring(node) or ""


def _returned(node: ast.FunctionDef) -> str:
    return ast.unparse(node.returns) if node.returns else ""


def test_array_functions_say_shapes():
    functions = {
        f"{path.relative_to(ROOT)}: {name}": text
        for package in PACKAGES
        for path in sorted((ROOT / package).rglob("*.py"))
        for name, text in array_functions(path.read_text(encoding="utf-8"))
    }
    without = [name for name, text in functions.items() if not SHAPE.search(text)]
    assert len(functions) > 150
    assert len(without) <= WITHOUT_SHAPE * len(functions), without
