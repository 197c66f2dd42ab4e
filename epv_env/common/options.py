"""Options of commands, each declared once: as a field of a dataclass, for Python and for the shell.

    @dataclass(frozen=True)
    class Options:
        log: Annotated[Path, "folder with log.json"]
        _: KW_ONLY
        false_alarms: Annotated[float, Number(float, 1e-6, 100.0), "per hour of operation"] = 0.01

A field before `KW_ONLY` is positional, `false_alarms` is `--false-alarms`, and an option without default
is required. `Annotated` holds the type, what reads the text, the help, and keywords of argparse; the
last count. Options of one `group` exclude each other; `flag` is another name than the field's.
"""

import argparse
import math
import os
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import MISSING, Field, dataclass, fields
from pathlib import Path
from types import ModuleType, NoneType
from typing import Annotated, Any, get_args, get_type_hints

from epv_env.common.files import check_writable

SHOWN_DEFAULT = " (default: %(default)s)"
"""Ends the help of an option whose default is one value."""


def parser_of(module: ModuleType, program: str) -> argparse.ArgumentParser:
    """The parser of a command."""
    parser = argparse.ArgumentParser(
        prog=program,
        description=module.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    groups = defaultdict(parser.add_mutually_exclusive_group, {"": parser})
    hints = get_type_hints(module.Options, include_extras=True)
    for entry in fields(module.Options):
        _add(groups, entry, *get_args(hints[entry.name]))
    return parser


def parse(module: ModuleType, program: str, arguments: Sequence[str]) -> Any:
    """The command's Options. --quick sets QUICK; what is given beside it still holds."""
    parser = parser_of(module, program)
    if getattr(parser.parse_known_args(arguments)[0], "quick", False):
        parser.set_defaults(**module.QUICK)
    return module.Options(**vars(parser.parse_args(arguments)))


def _add(groups: dict[str, Any], entry: Field, kind: Any, *metadata: Any) -> None:
    """Add the option of a field, whose type is Annotated[kind, *metadata], to the parser or a group."""
    keywords: dict[str, Any] = {"default": None if entry.default is MISSING else entry.default}
    if kind is bool:
        keywords["action"] = "store_true"
    else:
        keywords["type"] = next(k for k in get_args(kind) or (kind,) if k is not NoneType)
    for item in metadata:
        keywords |= (
            item if isinstance(item, dict) else {"help" if isinstance(item, str) else "type": item}
        )
    if isinstance(entry.default, (int, float, str, Path)) and kind is not bool:
        keywords["help"] += SHOWN_DEFAULT
    if isinstance(entry.default, tuple):
        keywords["default"] = list(entry.default)  # argparse appends to a copy
    if not entry.kw_only:
        optional = {} if entry.default is MISSING else {"nargs": "?"}
        groups[""].add_argument(entry.name, **optional | keywords)
        return
    keywords |= {"dest": entry.name, "required": entry.default is MISSING}
    flag = keywords.pop("flag", f"--{entry.name.replace('_', '-')}")
    groups[keywords.pop("group", "")].add_argument(flag, **keywords)


def writable_file(text: str) -> Path:
    """A path whose folder can be written, for argparse."""
    path = Path(text)
    writable_folder(str(path.parent))
    if path.is_dir():
        raise argparse.ArgumentTypeError(f"{path} is a folder: give the name of a file")
    try:
        check_writable(path)
    except OSError as error:
        raise argparse.ArgumentTypeError(f"{path}: {error.strerror}") from None
    return path


def writable_folder(text: str) -> Path:
    """A path at which a folder exists or can be made and written, for argparse."""
    path = Path(text)
    existing = path.absolute()
    while not existing.exists():
        existing = existing.parent
    if not existing.is_dir():
        raise argparse.ArgumentTypeError(f"{existing} is not a folder: choose another path")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise argparse.ArgumentTypeError(f"{existing} cannot be written: choose another path")
    return path


@dataclass(frozen=True)
class Number:
    """A number within a range, for argparse. What lies beyond is a slip, and would fail late."""

    kind: type[int] | type[float]
    low: float
    high: float

    def __call__(self, text: str) -> float:
        """The number. Raises ArgumentTypeError, with the range in its sentence."""
        try:
            value = self.kind(text)
        except ValueError:
            value = math.nan
        if not self.low <= value <= self.high:  # not true for NaN
            name = "whole number" if self.kind is int else "number"
            shown = text if len(text) < 40 else text[:40] + "..."
            span = f"from {self.low:.10g} to {self.high:.10g}"
            raise argparse.ArgumentTypeError(f"{shown} must be a {name} {span}")
        return value


COUNT = Number(int, 1, 10**9)
Count = Annotated[int, COUNT]
"""Episodes, trials or steps."""
SEED = Number(int, 0, 2**32 - 1)
Seed = Annotated[int, SEED]
"""What NumPy's and torch's generators take."""
Seconds = Annotated[float, Number(float, 0.05, 3600.0)]
"""Length of an episode [s], some control periods at least: more than an hour fills the memory."""
JudgedSeconds = Annotated[float, Number(float, 0.55, 3600.0), "length of an episode [s]"]
"""Length of an episode whose pressures are judged [s]: they count from 0.5 s on."""
Folder = Annotated[Path, writable_folder, "folder of results"]
"""A folder that exists or can be made."""
PlantFile = Annotated[Path | None, {"metavar": "FILE"}, "plant file (default: the report's calibration)"]
Names = Annotated[Sequence[str], {"nargs": "+", "metavar": "NAME"}]
Device = Annotated[
    str, {"choices": ("cpu", "cuda")}, "for the episodes: cuda is an NVIDIA accelerator (extra gpu)"
]
Quick = Annotated[bool, "a short run that shows that all works"]


@dataclass(frozen=True, kw_only=True)
class Episodes:
    """Options of the commands that compare controllers on episodes."""

    duration: JudgedSeconds = 10.0
    seed: Annotated[Seed, "of the first episode, within its range"] = 0
    plant: PlantFile = None
    workers: Annotated[int | None, Number(int, 1, 1024), "processes (default: all cores)"] = None
    device: Device = "cpu"
