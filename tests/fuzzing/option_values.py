"""Numbers without sense for every option that takes a number; the commands list the options."""

import argparse
import contextlib
import importlib
import io
from collections.abc import Iterator
from functools import cache
from typing import Any, NoReturn
from unittest.mock import patch

from epv_env.common.commands import commands, parser_of
from training.console.command import COMMANDS, IDENTIFICATION

NO_VALUES = ("-1", "nan", "inf", "1e999", "9" * 400, "", "x", "1,5", "0x10")
"""What no option takes: negative, infinite, far beyond sense, or no number."""

OPERANDS = {
    "export": ("nowhere",),
    "export-fmu": ("plant",),
    "import": ("nowhere.csv",),
    "run": ("nowhere",),
    "gap": ("nowhere",),
}
"""What a command needs beside its options."""


class _Taken(BaseException):
    """Carries the parser of a command that was about to parse."""

    def __init__(self, parser: argparse.ArgumentParser):
        self.parser = parser


@cache
def number_options() -> tuple[tuple[str, str], ...]:
    """Every (command, option) that takes a number."""
    return tuple(
        (name, action.option_strings[-1])
        for name in COMMANDS
        for action in _actions(_parser_of(name))
        if action.option_strings and action.type in (int, float)
    )


def refusal(name: str, option: str, value: str) -> tuple[Any, str]:
    """Exit status of a command that gets this value, and the last line that it says."""
    entry = COMMANDS[name]
    own = [name] if entry.module == IDENTIFICATION else []
    line = [*own, *OPERANDS.get(name, ()), "--out", "fuzz-out", f"{option}={value}"]
    said = io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        try:
            status = importlib.import_module(entry.module).main(line)
        except (ValueError, OSError) as error:
            status = 2
            print(error, file=said)
        except SystemExit as end:
            status = end.code
    return status, (said.getvalue().strip().splitlines() or [""])[-1]


def says(sentence: str, option: str) -> bool:
    """Whether a sentence names an option, with its dashes or in words."""
    return option.strip("-").replace("-", " ") in sentence.replace("-", " ")


def _parser_of(name: str) -> argparse.ArgumentParser:
    """The parser of a command."""
    module = commands(["identification.commands"]).get(name)
    if module is not None:
        return parser_of(importlib.import_module(module), name)

    def take(parser: argparse.ArgumentParser, *_: Any, **__: Any) -> NoReturn:
        raise _Taken(parser)

    with (
        patch.object(argparse.ArgumentParser, "parse_args", take),
        patch.object(argparse.ArgumentParser, "parse_known_args", take),
    ):
        try:
            importlib.import_module(COMMANDS[name].module).main([])
        except _Taken as taken:
            return taken.parser
    raise AssertionError(f"{name} parses no arguments")


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """The options of a parser and of its subcommands."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for own in action.choices.values():
                yield from _actions(own)
        else:
            yield action
