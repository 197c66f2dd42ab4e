"""Every public name is documented, and array functions say the shapes of their arrays."""

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

Definition = ast.FunctionDef | ast.ClassDef


def sources() -> dict[Path, str]:
    """Text of every file of the packages."""
    files = (path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py")))
    return {path: path.read_text(encoding="utf-8") for path in files}


def public(source: str) -> Iterator[tuple[str, Definition]]:
    """Public classes, functions and methods of a file, by their qualified names."""
    waiting: list[tuple[str, ast.stmt]] = [("", node) for node in ast.parse(source).body]
    while waiting:
        prefix, node = waiting.pop()
        if isinstance(node, Definition) and not node.name.startswith("_"):
            yield prefix + node.name, node
            if isinstance(node, ast.ClassDef):
                waiting += [(f"{prefix}{node.name}.", child) for child in node.body]


def undocumented(source: str) -> list[str]:
    """Public names of a file without a docstring, or a `__doc__` that is put together."""
    return [
        name
        for name, node in public(source)
        if not ast.get_docstring(node)
        and not any("__doc__ =" in ast.unparse(line) for line in node.body)
    ]


def handles_arrays(node: Definition) -> bool:
    """Whether a function takes or returns an array."""
    if isinstance(node, ast.ClassDef):
        return False
    returned = ast.unparse(node.returns) if node.returns else ""
    return bool(re.search("NDArray|ArrayLike", ast.unparse(node.args) + returned))


def test_every_module_and_public_name_has_a_docstring():
    missing = []
    for path, source in sources().items():
        place = path.relative_to(ROOT)
        missing += [] if ast.get_docstring(ast.parse(source)) else [str(place)]
        missing += [f"{place}: {name}" for name in undocumented(source)]
    assert missing == []


def test_array_functions_say_shapes():
    functions = {
        f"{path.relative_to(ROOT)}: {name}": ast.get_docstring(node) or ""
        for path, source in sources().items()
        for name, node in public(source)
        if handles_arrays(node)
    }
    without = [name for name, text in functions.items() if not SHAPE.search(text)]
    assert len(functions) > 150
    assert len(without) <= WITHOUT_SHAPE * len(functions), without


def test_a_missing_docstring_and_a_missing_shape_are_found():
    source = "class A:\n    '''A.'''\n    def b(self, x: NDArray):\n        return x\n"
    assert undocumented(source) == ["A.b"]
    ((_, _), (_, method)) = public(source)
    assert handles_arrays(method)
    assert not SHAPE.search("Values over time.")
    assert SHAPE.search("Values over time, (runs, samples) [Pa].")
