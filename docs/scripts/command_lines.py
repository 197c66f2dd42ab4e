"""The reference page of command lines, written from the parsers of the commands themselves."""

import argparse
import os
import runpy
import shlex
import sys
from pathlib import Path
from unittest.mock import patch

from epv_env.common.commands import commands
from training.epv import PACKAGES

ROOT = Path(__file__).parents[2]
"""The repository's root."""
WIDTH = "88"
"""Characters in a line of usage."""


class _Captured(Exception):
    """Carries a parser out of the command that made it."""


def shown_commands() -> list[str]:
    """Every command of the page, as a user types it."""
    return [*(f"epv {name}" for name in commands(PACKAGES)), "python -m docs.examples.tank"]


def parser_of(command: str) -> argparse.ArgumentParser:
    """The parser of a command: `epv NAME`, `python -m MODULE ...` or `python FILE`.

    The command is started, and stopped at the moment it reads its options.
    Raises RuntimeError if the command reads none.
    """
    words = shlex.split(command.replace("epv ", "python -m training.epv ", 1))
    module = words[1] == "-m"
    name, *arguments = words[2:] if module else words[1:]

    def stop(parser: argparse.ArgumentParser, *_: object) -> None:
        raise _Captured(parser)

    with (
        patch.object(sys, "argv", [name, *arguments]),
        patch.object(argparse.ArgumentParser, "parse_known_args", stop),
    ):
        try:
            if module:
                runpy.run_module(name, run_name="__main__")
            else:
                runpy.run_path(str(ROOT / name), run_name="__main__")
        except _Captured as captured:
            return captured.args[0]
    raise RuntimeError(f"{command} reads no options: take it off the reference page's list")


def page() -> str:
    """All command lines as Markdown."""
    return "\n\n".join(map(_section, shown_commands())) + "\n"


def _section(command: str) -> str:
    """Heading, meaning, usage and a table of the options."""
    parser = parser_of(command)
    parser.prog = command
    with patch.dict(os.environ, {"COLUMNS": WIDTH, "NO_COLOR": "1"}):
        usage = parser.format_usage()
    rows = [_row(action) for action in parser._actions if action.dest != "help"]
    table = "\n".join(("| Option | Default | Meaning |", "|---|---|---|", *rows))
    return f"## `{parser.prog}`\n\n{parser.description}\n\n```text\n{usage.strip()}\n```\n\n{table}"


def _row(action: argparse.Action) -> str:
    """One option: its names, its default and what it means."""
    names = ", ".join(f"`{name}`" for name in action.option_strings or [action.dest.upper()])
    choices = f"one of {', '.join(map(str, action.choices))}" if action.choices else ""
    meaning = "; ".join(filter(None, (action.help, choices))).replace("%%", "%")
    return "| " + " | ".join(c.replace("|", "\\|") for c in (names, _default(action), meaning)) + " |"


def _default(action: argparse.Action) -> str:
    if action.required:
        return "required"
    if action.default is None or action.default is False or action.default == []:
        return "–"
    several = isinstance(action.default, list | tuple)
    return f"`{', '.join(map(str, action.default)) if several else action.default}`"
