"""What a measurement file holds, before anybody has said what it means."""

import importlib
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.common.extras import how_to_install
from epv_env.common.files import LARGEST_FILE


class ImportingError(ValueError):
    """A measurement file cannot become a recording: what, where, the rule, the remedy."""


class WrongCell(ValueError):
    """A cell of a column cannot be read."""

    def __init__(self, row: Any, cell: object, rule: str):
        """row: its label in the column."""
        super().__init__(f"{str(cell)[:40]!r}, {rule}")
        self.row = row


def check_cells(right: Any, cells: Any, rule: str) -> None:
    """Raise WrongCell for the first of the cells that is not right (boolean, of the same rows)."""
    if not right.all():
        row = right.idxmin()
        raise WrongCell(row, cells[row], rule)


@dataclass(frozen=True, kw_only=True)
class SourceChannel:
    """One series of numbers in a file, as it stands there."""

    name: str
    """As in the file."""
    unit: str
    """As in the file; empty where it says none."""
    values: NDArray
    """(samples,), in that unit; NaN where a row has no value, infinite where it is over-range."""
    time: NDArray | None = None
    """Times of the samples, (samples,) [s]; None: another channel of the table holds them."""
    begin: np.datetime64 | None = None
    """The point in time at which `time`, or a channel that holds times, is 0; None: not told."""
    table: str = ""
    """Channels of one table share their rows; the name of a group, sheet or struct, dots between the
    names of structs within structs."""
    file: str = ""
    """Name of its file, where several make one recording."""
    lines: NDArray | None = None
    """Line of each sample in a text file, (samples,)."""
    fault: str = ""
    """Why it cannot be used, with the remedy; its values are then empty."""

    @property
    def known(self) -> NDArray:
        """The values that are not missing."""
        return self.values[np.isfinite(self.values)]

    @property
    def full_name(self) -> str:
        """The name after those of file and table: a mapping file may use it."""
        return "/".join(filter(None, (self.file, self.table, self.name)))


NO_NUMBERS = "holds no numbers: export it as numbers"


def unread(name: str, why: str, table: str = "") -> SourceChannel:
    """A series that cannot be used; why: the rest of a sentence that its name begins."""
    return SourceChannel(name=name, unit="", values=np.empty(0), table=table, fault=f"{name} {why}")


@dataclass(frozen=True, kw_only=True)
class SourceFile:
    """A measurement file that was read."""

    path: Path
    format: str
    """Name of the format, with its version or dialect."""
    sha256: str
    """Of the file's bytes."""
    channels: tuple[SourceChannel, ...]
    """In the order of the file."""
    joined: tuple["SourceFile", ...] = ()
    """Files that hold further channels of the same recording."""

    def label(self, channel: SourceChannel) -> str:
        """A channel's name, after its table where another table has a channel of that name."""
        same = sum(other.name == channel.name for other in self.channels)
        return channel.full_name if same > 1 else channel.name

    def check(self, channel: SourceChannel) -> None:
        """Raise ImportingError if a channel that is needed has a fault."""
        if channel.fault:
            raise ImportingError(f"{self.path}, {channel.fault}")


LONGEST_NAME = 300
"""Characters that are read of a name."""

OVER_RANGE = 9e36
"""Readings beyond are marks of over-range: instruments write 9.9e37 (SCPI)."""


def usable(channel: SourceChannel, missing: Sequence[str]) -> SourceChannel:
    """The channel without the numbers among the marks of missing readings, over-range ones infinite."""
    numbers = [float(mark) for mark in missing if re.fullmatch(r"[+-]?\d+\.?\d*(e[+-]?\d+)?", mark)]
    values = np.where(np.abs(channel.values) > OVER_RANGE, np.inf, channel.values)
    values = np.where(np.isin(values, numbers), np.nan, values)
    return replace(channel, name=channel.name[:LONGEST_NAME], values=values)


def check_unpacked(path: Path, size: int) -> None:
    """Raise ImportingError if a file says that it unpacks to too many bytes, before it is read."""
    if size > LARGEST_FILE:
        raise ImportingError(
            f"{path} unpacks to more than {LARGEST_FILE:,} bytes: export the bench's channels alone"
        )


EXTRA = "bench-files"
"""Extra of pyproject.toml that holds the packages of all formats."""


def needed_package(name: str, purpose: str) -> ModuleType:
    """A package of the extra. Raises ImportingError that names the extra if it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        package = name.partition(".")[0]
        raise ImportingError(
            f"{purpose} need the package {package}, which is not installed: {how_to_install(EXTRA)}"
        ) from None
