"""The reference page of command lines, written from the parsers of the commands themselves."""

import argparse
import importlib
import os
from unittest.mock import patch

from epv_env.common.commands import commands, help_line
from epv_env.common.options import SHOWN_DEFAULT, parser_of
from training.epv import PACKAGES


def page() -> str:
    """All command lines as Markdown."""
    return "\n\n".join(_section(name, module) for name, module in commands(PACKAGES).items()) + "\n"


def _section(name: str, module: str) -> str:
    """Heading, meaning, usage and a table of the options."""
    parser = parser_of(importlib.import_module(module), f"epv {name}")
    with patch.dict(os.environ, {"COLUMNS": "88", "NO_COLOR": "1"}):
        usage = parser.format_usage()
    rows = [_row(action) for action in parser._actions if action.dest != "help"]
    table = "\n".join(("| Option | Default | Meaning |", "|---|---|---|", *rows))
    return f"## `epv {name}`\n\n{help_line(module)}\n\n```text\n{usage.strip()}\n```\n\n{table}"


def _row(action: argparse.Action) -> str:
    """One option: its names, its default and what it means."""
    names = ", ".join(f"`{name}`" for name in action.option_strings or [action.dest.upper()])
    choices = f"one of {', '.join(map(str, action.choices))}" if action.choices else ""
    meaning = "; ".join(filter(None, ((action.help or "").removesuffix(SHOWN_DEFAULT), choices)))
    cells = (names, _default(action), meaning)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _default(action: argparse.Action) -> str:
    if action.required:
        return "required"
    if action.default is None or action.default is False or action.default == []:
        return "–"
    several = isinstance(action.default, list | tuple)
    return f"`{', '.join(map(str, action.default)) if several else action.default}`"
