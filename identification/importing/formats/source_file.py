"""What a measurement file holds, before anybody has said what it means."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


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
