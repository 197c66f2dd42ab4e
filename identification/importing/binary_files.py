"""Measurement files of MDF, TDMS, Parquet and MATLAB, read by the packages of their formats."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
from numpy.typing import NDArray

from identification.importing.source_file import (
    STAMP,
    ImportingError,
    SourceChannel,
    needed_package,
    points_in_time,
    seconds,
)


def read_mdf(path: Path) -> tuple[str, list[SourceChannel]]:
    """Every numeric channel with the times of its master channel."""
    asammdf = needed_package("asammdf", "MDF files")
    with asammdf.MDF(path) as mdf:
        channels = [
            SourceChannel(
                name=signal.name,
                unit=signal.unit or "",
                values=np.asarray(signal.samples, dtype=float),
                time=np.asarray(signal.timestamps, dtype=float),
                table=f"group {signal.group_index}",
            )
            for signal in mdf.iter_channels(skip_master=True)
            if np.ndim(signal.samples) == 1 and np.asarray(signal.samples).dtype.kind in "iufb"
        ]
        return f"MDF {mdf.version}", channels


UNIT_PROPERTIES = ("unit_string", "NI_UnitDescription", "unit", "Unit")
"""Properties in which LabVIEW and its tools keep the unit."""


def read_tdms(path: Path) -> tuple[str, list[SourceChannel]]:
    """Every numeric channel; waveforms bring their own times."""
    nptdms = needed_package("nptdms", "TDMS files")
    with nptdms.TdmsFile.open(path) as file:
        channels = [
            _tdms_channel(group.name, channel)
            for group in file.groups()
            for channel in group.channels()
            if channel.dtype.kind in "iufM" and len(channel) > 1
        ]
    return "TDMS", channels


def _tdms_unit(properties: dict[str, Any]) -> str:
    return next((str(properties[name]) for name in UNIT_PROPERTIES if name in properties), "")


def _tdms_channel(group: str, channel: Any) -> SourceChannel:
    """A waveform with its times and their begin, or a channel whose times are another channel."""
    values, begin = seconds(np.asarray(channel[:]))
    waveform = bool(channel.properties.get("wf_increment"))
    return SourceChannel(
        name=channel.name,
        unit=_tdms_unit(channel.properties) or ("s" if begin is not None else ""),
        values=values,
        time=channel.time_track() if waveform else None,
        begin=channel.properties.get("wf_start_time") if waveform else begin,
        table=group,
    )


def read_parquet(path: Path) -> tuple[str, list[SourceChannel]]:
    """Every numeric column; its unit is the field's metadata `unit`, if there is one."""
    parquet = needed_package("pyarrow.parquet", "Parquet files")
    table = parquet.read_table(path)
    channels = []
    for field in table.schema:
        values = _numbers_or_times(f"{path}, {field.name}", table.column(field.name).to_numpy())
        if values.dtype.kind in "iufMm":
            unit = (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
            timed = values.dtype.kind in "Mm"
            numbers, begin = seconds(values)
            channels.append(
                SourceChannel(name=field.name, unit="s" if timed else unit, values=numbers, begin=begin)
            )
    return "Parquet", channels


def _numbers_or_times(place: str, values: NDArray) -> NDArray:
    """A column as it is, or as points in time where its texts are some."""
    texts = values.dtype.kind == "O" and len(values) and isinstance(values[0], str)
    return points_in_time(place, values) if texts and STAMP.match(values[0]) else values


HDF5_SIGNATURE = b"\x89HDF"
"""First bytes of HDF5; MAT 7.3 has them after its own header of 512 bytes."""

VALUE_FIELDS, TIME_FIELDS, UNIT_FIELDS = ("data", "values", "value"), ("time", "t"), ("unit", "units")
"""Fields of a struct that holds one channel."""

TIME_UNIT_FIELDS = ("time_unit", "t_unit", "timeunit", "time_units")
"""Fields of such a struct that hold the unit of its times."""


def read_matlab(path: Path) -> tuple[str, list[SourceChannel]]:
    """Every numeric vector, and every column of a numeric matrix."""
    with path.open("rb") as stream:
        head = stream.read(516)
    if HDF5_SIGNATURE in (head[:4], head[512:516]):
        content = needed_package("pymatreader", "MATLAB 7.3 files").read_mat(str(path))
        version = "MATLAB 7.3"
    else:
        content = scipy.io.loadmat(path, simplify_cells=True)
        version = "MATLAB 5"
    return version, list(_matlab_channels(str(path), "", content))


def _matlab_channels(file: str, path: str, content: Mapping[str, Any]) -> Iterator[SourceChannel]:
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
            yield from _matlab_channels(file, full, value)
        elif isinstance(value, np.ndarray):
            _refuse_object(file, full, value)
            yield from _matlab_columns(full, value, units.get(name, ""), path)


def _matlab_columns(
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
    yield from _matlab_columns(name, np.asarray(_first(content, VALUE_FIELDS)), str(unit or ""), name)
    if time is not None:
        time_unit = str(_first(content, TIME_UNIT_FIELDS) or "")
        yield from _matlab_columns(f"{name}.time", np.asarray(time), time_unit, name)


def _simulink(path: str, time: NDArray, signals: Any) -> Iterator[SourceChannel]:
    """Simulink's structure with time: signals have values and label."""
    for number, signal in enumerate(signals if isinstance(signals, list) else [signals], start=1):
        name = str(signal.get("label") or f"{path}.signals({number})")
        yield from _matlab_columns(name, np.asarray(signal["values"]), "", path, time)


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
