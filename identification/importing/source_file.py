"""What a measurement file holds, before anybody has said what it means."""

import importlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from epv_env.common.extras import how_to_install
from epv_env.common.files import LARGEST_FILE


class ImportingError(ValueError):
    """A measurement file cannot become a recording: what, where, the rule, the remedy."""


@dataclass(frozen=True, kw_only=True)
class SourceChannel:
    """One series of numbers in a file, as it stands there."""

    name: str
    """As in the file."""
    unit: str
    """As in the file; empty where it says none."""
    values: NDArray
    """(samples,), in that unit; NaN where a row has no value."""
    time: NDArray | None = None
    """Times of the samples, (samples,) [s]; None: another channel of the table holds them."""
    begin: np.datetime64 | None = None
    """The point in time at which `time`, or a channel that holds times, is 0; None: not told."""
    table: str = ""
    """Channels of one table share their rows; the name of a group, sheet or struct, dots between the
    names of structs within structs."""

    @property
    def known(self) -> NDArray:
        """The values that are not missing."""
        return self.values[np.isfinite(self.values)]

    @property
    def full_name(self) -> str:
        """The name after that of the table: a mapping file may use it."""
        return f"{self.table}/{self.name}" if self.table else self.name


def unread(name: str, table: str = "", why: str = "no numbers") -> SourceChannel:
    """A series that cannot be used: it stands in the list of channels with the reason."""
    return SourceChannel(name=f"{name} ({why})", unit="", values=np.empty(0), table=table)


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

    def label(self, channel: SourceChannel) -> str:
        """A channel's name, after its table where another table has a channel of that name."""
        same = sum(other.name == channel.name for other in self.channels)
        return channel.full_name if same > 1 else channel.name


MOST_CHANNELS, LONGEST_NAME = 2_000, 300
"""Most channels of a file, and most characters of a name or unit: an import then ends in seconds."""


def limited(path: Path, channels: Iterable[SourceChannel]) -> list[SourceChannel]:
    """The channels. Raises ImportingError as soon as there are too many or a name is too long."""
    kept: list[SourceChannel] = []
    for channel in channels:
        check_number(path, len(kept) + 1)
        if max(len(channel.name), len(channel.unit)) > LONGEST_NAME:
            raise ImportingError(
                f"{path}: the channel {channel.name[:40]!r}... has a name or unit of more than "
                f"{LONGEST_NAME} characters: shorten it"
            )
        kept.append(channel)
    return kept


def check_number(path: Path, channels: int) -> None:
    """Raise ImportingError if a file has too many channels."""
    if channels > MOST_CHANNELS:
        raise ImportingError(
            f"{path} has more than {MOST_CHANNELS} channels: export only those of the bench"
        )


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
