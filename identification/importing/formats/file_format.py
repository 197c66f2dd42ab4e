"""What a format of measurement files consists of."""

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from epv_env.common.extras import how_to_install
from identification.importing.formats.source_file import ImportingError, SourceChannel

EXTRA = "bench-files"
"""Extra of pyproject.toml that holds the packages of all formats."""


@dataclass(frozen=True, kw_only=True)
class FileFormat:
    """One format: its suffixes and its reader.

    A new format takes two steps: a file of this folder that defines a FileFormat, and a line in
    `registry.FORMATS`.
    """

    name: str
    """Of the format in messages."""
    suffixes: tuple[str, ...]
    """Ends of file names, in lower case."""
    read: Callable[[Path], tuple[str, Sequence[SourceChannel]]]
    """Version or dialect, and the channels. Raises ImportingError."""


def needed_package(name: str, purpose: str) -> ModuleType:
    """A package of the extra. Raises ImportingError that names the extra if it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        package = name.partition(".")[0]
        raise ImportingError(
            f"{purpose} need the package {package}, which is not installed: {how_to_install(EXTRA)}"
        ) from None
