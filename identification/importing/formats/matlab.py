"""MATLAB's MAT files: version 4 to 7 by SciPy, version 7.3 (HDF5) by pymatreader.

Read are vectors, matrices (a channel per column), structs of them, Simulink's "structure with time",
and structs with the fields data (or values), time and unit.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
from numpy.typing import NDArray

from identification.importing.formats.file_format import FileFormat, needed_package
from identification.importing.formats.source_file import ImportingError, SourceChannel

HDF5_SIGNATURE = b"\x89HDF"
"""First bytes of HDF5; MAT 7.3 has them after its own header of 512 bytes."""

VALUE_FIELDS, TIME_FIELDS, UNIT_FIELDS = ("data", "values", "value"), ("time", "t"), ("unit", "units")
"""Fields of a struct that holds one channel."""

TIME_UNIT_FIELDS = ("time_unit", "t_unit", "timeunit", "time_units")
"""Fields of such a struct that hold the unit of its times."""


def read(path: Path) -> tuple[str, list[SourceChannel]]:
    """Every numeric vector, and every column of a numeric matrix."""
    with path.open("rb") as stream:
        head = stream.read(516)
    if HDF5_SIGNATURE in (head[:4], head[512:516]):
        content = needed_package("pymatreader", "MATLAB 7.3 files").read_mat(str(path))
        version = "MATLAB 7.3"
    else:
        content = scipy.io.loadmat(path, simplify_cells=True)
        version = "MATLAB 5"
    return version, list(_channels(str(path), "", content))


def _channels(file: str, path: str, content: Mapping[str, Any]) -> Iterator[SourceChannel]:
    """The channels of a struct, and of the structs in it."""
    time, units = _simulink_time(content), _units(content)
    for name, value in content.items():
        full = f"{path}.{name}" if path else name
        if name.startswith("__") or (time is not None and name == "time"):
            continue
        if isinstance(value, Mapping) and _first(value, VALUE_FIELDS) is not None and time is None:
            yield from _single(full, value)
        elif time is not None and name == "signals":
            yield from _simulink(path, time, value)
        elif isinstance(value, Mapping):
            yield from _channels(file, full, value)
        elif isinstance(value, np.ndarray):
            _refuse_object(file, full, value)
            yield from _columns(full, value, units.get(name, ""), path)


def _columns(
    name: str, value: NDArray, unit: str, path: str, time: NDArray | None = None
) -> Iterator[SourceChannel]:
    """The columns of a numeric array; a row counts as a column."""
    value = np.squeeze(value)
    if value.dtype.kind not in "iufb" or value.ndim not in (1, 2) or value.shape[0] < 2:
        return
    if value.ndim == 1:
        value = value[:, None]
    for number, column in enumerate(value.T, start=1):
        yield SourceChannel(
            name=name if value.shape[1] == 1 else f"{name}({number})",
            unit=unit,
            values=np.asarray(column, dtype=float),
            time=time,
            table=path,
        )


def _single(name: str, content: Mapping[str, Any]) -> Iterator[SourceChannel]:
    """A struct that holds one channel, perhaps with its own time."""
    unit, time = _first(content, UNIT_FIELDS), _first(content, TIME_FIELDS)
    yield from _columns(name, np.asarray(_first(content, VALUE_FIELDS)), str(unit or ""), name)
    if time is not None:
        time_unit = str(_first(content, TIME_UNIT_FIELDS) or "")
        yield from _columns(f"{name}.time", np.asarray(time), time_unit, name)


def _simulink(path: str, time: NDArray, signals: Any) -> Iterator[SourceChannel]:
    """Simulink's structure with time: signals have values and label."""
    for number, signal in enumerate(signals if isinstance(signals, list) else [signals], start=1):
        name = str(signal.get("label") or f"{path}.signals({number})")
        yield from _columns(name, np.asarray(signal["values"]), "", path, time)


def _simulink_time(content: Mapping[str, Any]) -> NDArray | None:
    if {"time", "signals"} <= set(content):
        return np.ravel(np.asarray(content["time"], dtype=float))
    return None


def _units(content: Mapping[str, Any]) -> dict[str, str]:
    """Units by channel, where a struct of that name lists them."""
    units = _first(content, UNIT_FIELDS)
    return {k: v for k, v in units.items() if isinstance(v, str)} if isinstance(units, Mapping) else {}


def _first(content: Mapping[str, Any], names: tuple[str, ...]) -> Any:
    """The first of these fields that a struct has, whatever its case; None if it has none."""
    return next((value for key, value in content.items() if key.lower() in names), None)


def _refuse_object(file: str, name: str, value: NDArray) -> None:
    if type(value).__name__ in ("MatlabOpaque", "MatlabFunction"):
        raise ImportingError(
            f"{file}: {name} is a MATLAB object such as a timeseries or table: save its numbers, for "
            "example with save('file.mat', '-struct', 's') of a struct s of vectors"
        )


MATLAB = FileFormat(name="MATLAB", suffixes=(".mat",), read=read)
"""The format, for the registry."""
