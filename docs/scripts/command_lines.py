"""The reference page of command lines, written from the parsers of the commands themselves."""

import argparse
import os
import runpy
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import patch

ROOT = Path(__file__).parents[2]
"""The repository's root."""
MODULES = ("identification", "docs.examples.tank")
"""Packages that run as `python -m NAME`."""
WIDTH = "88"
"""Characters in a line of usage."""


class _Captured(Exception):
    """Carries a parser out of the command that made it."""


@contextmanager
def _parsers_stop() -> Iterator[None]:
    """Within, a parser raises `_Captured` with itself instead of reading options."""

    def stop(parser: argparse.ArgumentParser, *_: object) -> None:
        raise _Captured(parser)

    with patch.object(argparse.ArgumentParser, "parse_known_args", stop):
        yield


def scripts() -> list[str]:
    """The scripts of `training/` that run from the command line, as paths from the root."""
    files = sorted((ROOT / "training").glob("*.py"))
    return [f"training/{file.name}" for file in files if "__main__" in file.read_text(encoding="utf-8")]


def parser_of(command: str) -> argparse.ArgumentParser:
    """The parser of `training/NAME.py` or of `python -m NAME`.

    The command is started, and stopped at the moment it reads its options.
    Raises RuntimeError if the command reads none.
    """
    start = runpy.run_path if command.endswith(".py") else runpy.run_module
    target = str(ROOT / command) if command.endswith(".py") else command
    with patch.object(sys, "argv", [command]), _parsers_stop():
        try:
            start(target, run_name="__main__")
        except _Captured as captured:
            return captured.args[0]
    raise RuntimeError(f"{command} reads no options: take it off the reference page's list")


def subparsers(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """Parsers of a command's own commands by name; empty where there are none."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            return dict(action.choices)
    return {}


def page() -> str:
    """All command lines as Markdown."""
    parts = []
    for command in (*MODULES, *scripts()):
        shown = f"python {command}" if command.endswith(".py") else f"python -m {command}"
        parser = parser_of(command)
        own = subparsers(parser)
        parts.append(f"## `{shown}`\n\n{parser.description}")
        parts += [_section(f"{shown} {name}", sub, "###") for name, sub in own.items()]
        if not own:
            parts.append(_options(shown, parser))
    return "\n\n".join(parts) + "\n"


def _section(shown: str, parser: argparse.ArgumentParser, level: str) -> str:
    return f"{level} `{shown}`\n\n{parser.description}\n\n{_options(shown, parser)}"


def _options(shown: str, parser: argparse.ArgumentParser) -> str:
    """Usage and a table of options."""
    parser.prog = shown
    with patch.dict(os.environ, {"COLUMNS": WIDTH, "NO_COLOR": "1"}):
        usage = parser.format_usage()
    rows = [_row(action) for action in parser._actions if action.dest != "help"]
    table = "\n".join(("| Option | Default | Meaning |", "|---|---|---|", *rows))
    return f"```text\n{usage.strip()}\n```\n\n{table}"


def _row(action: argparse.Action) -> str:
    """One option: its names, its default and what it means."""
    names = ", ".join(f"`{name}`" for name in action.option_strings or [action.dest.upper()])
    cells = (names, _default(action), _meaning(action))
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _default(action: argparse.Action) -> str:
    if action.required:
        return "required"
    if action.default is None or action.default is False or action.default == []:
        return "–"
    several = isinstance(action.default, list | tuple)
    text = ", ".join(map(str, action.default)) if several else str(action.default)
    return f"`{text}`"


def _meaning(action: argparse.Action) -> str:
    choices = f"one of {', '.join(map(str, action.choices))}" if action.choices else ""
    return "; ".join(filter(None, (action.help, choices)))


if __name__ == "__main__":
    print(page())
