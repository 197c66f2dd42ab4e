"""Docstrings give shapes and units in brackets; the site must not read two of them as a link."""

import re
from typing import Any

import griffe


class UnitBrackets(griffe.Extension):
    """Escapes the second of two brackets: `(n,) [s] [bar]` would be a link to `bar` in Markdown."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Change the docstring of each name that mkdocstrings collects."""
        if obj.docstring is not None:
            obj.docstring.value = re.sub(r"\](\s+)\[", r"]\1\\[", obj.docstring.value)
