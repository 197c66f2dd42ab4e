"""What the fields of a named tuple mean, read from the texts below them."""

import ast
import inspect
import re
from textwrap import dedent


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
