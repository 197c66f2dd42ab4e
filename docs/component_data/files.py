"""Reading columns of numbers from the measured files."""

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FEWEST_ROWS = 100
"""Every record of the page is longer."""


def columns(
    path: Path,
    which: tuple[int, ...],
    *,
    delimiter: str,
    header: int = 0,
    convert: Callable[[str], float] = float,
) -> Array:
    """Columns `which` of a table, (columns, rows).

    header: lines to skip. convert: from a field to its number. Raises OSError where there is no file,
    ValueError where it does not hold such columns of numbers.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of an empty file, refused below
            table = np.loadtxt(
                path, delimiter=delimiter, skiprows=header, usecols=which, converters=convert, ndmin=2,
                encoding="utf-8",
            )  # fmt: skip
    except ValueError as error:
        raise ValueError(f"{path}: {str(error).rstrip('.')}; take the file as published") from None
    if len(table) < FEWEST_ROWS:
        raise ValueError(
            f"{path} has {len(table)} rows, fewer than {FEWEST_ROWS}: take the file as published"
        )
    return table.T
