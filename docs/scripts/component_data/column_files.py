"""Reading columns of numbers from the measured files."""

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from docs.scripts.component_data.settings import DEFAULTS, ComponentSettings

Array = NDArray[np.float64]


def columns(
    path: Path,
    indices: tuple[int, ...],
    *,
    delimiter: str,
    header: int = 0,
    convert: Callable[[str], float] = float,
    settings: ComponentSettings = DEFAULTS,
) -> Array:
    """Columns of a table of numbers in its units, (columns, rows).

    Args:
        path: the file.
        indices: of the columns.
        delimiter: between the columns.
        header: lines to skip.
        convert: from a field's text to its number.
        settings: the least number of rows.

    Raises:
        OSError: there is no file.
        ValueError: the file does not hold such columns of numbers.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of an empty file, refused below
            table = np.loadtxt(
                path, delimiter=delimiter, skiprows=header, usecols=indices, converters=convert, ndmin=2,
                encoding="utf-8",
            )  # fmt: skip
    except ValueError as error:
        raise ValueError(f"{path}: {str(error).rstrip('.')}; take the file as published") from None
    if len(table) < settings.fewest_rows:
        raise ValueError(
            f"{path} has {len(table)} rows, fewer than {settings.fewest_rows}: take the file as "
            "published"
        )
    return table.T
