"""Measurement files of MDF, TDMS, Parquet and MATLAB, read by the packages of their formats."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
from numpy.typing import NDArray

from identification.importing import times
from identification.importing.cells import Columns
from identification.importing.source_file import (
    NO_NUMBERS,
    SourceChannel,
    check_unpacked,
    needed_package,
    unread,
)
from identification.importing.units import parsed_unit


def read_mdf(path: Path) -> tuple[str, list[SourceChannel]]:
    """Every numeric channel with the times of its master channel; readings marked invalid are NaN."""
    asammdf = needed_package("asammdf", "MDF files")
    with path.open("rb") as stream:
        if stream.read(3) not in MDF_SIGNATURES:  # asammdf would print a traceback beside its error
            raise ValueError("it does not begin as MDF does")
    # It would print a traceback for a file whose reading failed; `with` closes the others.
    for version in (3, 4):
        module = needed_package(f"asammdf.blocks.mdf_v{version}", "MDF files")
        getattr(module, f"MDF{version}").__del__ = lambda _: None
    with asammdf.MDF(path) as mdf:
        numbers = sum(group.channel_group.cycles_nr * len(group.channels) for group in mdf.groups)
        check_unpacked(path, numbers * NUMBER)
        return f"MDF {mdf.version}", [_mdf_channel(mdf, s) for s in mdf.iter_channels(skip_master=True)]


NUMBER = 8
"""Bytes of a number as it is read."""

MDF_SIGNATURES = (b"MDF", b"UnF")
"""First bytes of MDF, and of MDF that its writer did not finish."""

ALL_INVALID = 1
"""Flag of an MDF 4 channel of which no reading counts; asammdf leaves it to its callers."""


def _mdf_channel(mdf: Any, signal: Any) -> SourceChannel:
    """A channel with its own times, NaN where a reading is marked invalid."""
    table = f"group {signal.group_index}"
    samples = np.asarray(signal.samples)
    if samples.ndim != 1 or samples.dtype.kind not in "iufb":
        return unread(signal.name, NO_NUMBERS, table)
    channel = mdf.groups[signal.group_index].channels[signal.channel_index]
    bits = False if signal.invalidation_bits is None else np.asarray(signal.invalidation_bits)
    invalid = bits | bool(getattr(channel, "flags", 0) & ALL_INVALID)
    return SourceChannel(
        name=signal.name,
        unit=signal.unit or "",
        values=np.where(invalid, np.nan, samples.astype(float)),
        time=np.asarray(signal.timestamps, dtype=float),
        table=table,
    )


UNIT_PROPERTIES = ("unit_string", "NI_UnitDescription", "unit", "Unit")
"""Properties in which LabVIEW and its tools keep the unit."""


def read_tdms(path: Path) -> tuple[str, list[SourceChannel]]:
    """Every numeric channel; waveforms bring their own times."""
    nptdms = needed_package("nptdms", "TDMS files")
    with nptdms.TdmsFile.open(path) as file:
        return "TDMS", [
            _tdms_channel(group.name, channel)
            for group in file.groups()
            for channel in group.channels()
            if len(channel) > 1
        ]


def _tdms_channel(group: str, channel: Any) -> SourceChannel:
    """A waveform with its times and their begin, or a channel whose times are another channel."""
    if channel.dtype.kind not in "iufM":
        return unread(channel.name, NO_NUMBERS, group)
    values, begin = times.seconds(np.asarray(channel[:]))
    properties = channel.properties
    time = _waveform_times(properties, len(values))
    unit = next((str(properties[name]) for name in UNIT_PROPERTIES if name in properties), "")
    return SourceChannel(
        name=channel.name,
        unit=unit or ("s" if begin is not None else ""),
        values=values,
        time=time,
        begin=begin if time is None else properties.get("wf_start_time"),
        table=group,
    )


def _waveform_times(properties: Mapping[str, Any], count: int) -> NDArray | None:
    """Times of a waveform's samples, (count,) [s]; None: it is no waveform over time."""
    unit = parsed_unit(str(properties.get("wf_xunit_string") or "s"))
    if not properties.get("wf_increment") or unit is None or unit.quantity != "time":
        return None
    start, step = (float(properties.get(f"wf_{name}", 0.0)) for name in ("start_offset", "increment"))
    return unit.size * (start + step * np.arange(count))


def read_parquet(path: Path) -> tuple[str, list[SourceChannel]]:
    """Every numeric column, NaN where it is null; its unit is the field's metadata `unit`, if any."""
    parquet = needed_package("pyarrow.parquet", "Parquet files")
    found = parquet.read_metadata(path)
    check_unpacked(path, found.num_rows * found.num_columns * NUMBER)
    table = parquet.read_table(path)
    told = [field.metadata or {} for field in table.schema]
    columns = Columns(
        frame=table.to_pandas(ignore_metadata=True).set_axis(range(table.num_columns), axis="columns"),
        lines=np.arange(1, table.num_rows + 1),
        decimal=".",
        names=table.column_names,
        units=[metadata.get(b"unit", b"").decode("utf-8", "replace") for metadata in told],
    )
    return "Parquet", [replace(channel, lines=None) for channel in columns.channels()]


HDF5_SIGNATURE = b"\x89HDF"
"""First bytes of HDF5; MAT 7.3 has them after its own header of 512 bytes."""

VALUE_FIELDS, TIME_FIELDS, UNIT_FIELDS = ("data", "values", "value"), ("time", "t"), ("unit", "units")
NAME_FIELDS = ("label", "name")
"""Fields of a struct that holds one channel; the name counts in an array of such structs."""

START_FIELDS, INTERVAL_FIELDS = ("tstart", "t0", "start"), ("tinterval", "interval", "dt", "ts")
"""Numbers that stand for the times of the vectors beside them [s]."""

OBJECTS = ("MatlabOpaque", "MatlabFunction")
"""What scipy makes of timeseries, tables and functions, which hold no numbers to read."""


def read_matlab(path: Path) -> tuple[str, list[SourceChannel]]:
    """Every numeric vector, and every column of a numeric matrix."""
    with path.open("rb") as stream:
        head = stream.read(516)
    if HDF5_SIGNATURE in (head[:4], head[512:516]):
        check_unpacked(path, _hdf5_size(path))
        content = needed_package("pymatreader", "MATLAB 7.3 files").read_mat(str(path))
        return "MATLAB 7.3", list(_matlab_channels("", content))
    shapes = [shape for _, shape, _ in scipy.io.whosmat(path)]
    check_unpacked(path, NUMBER * sum(map(math.prod, shapes)))
    return "MATLAB 5", list(_matlab_channels("", scipy.io.loadmat(path, simplify_cells=True)))


def _hdf5_size(path: Path) -> int:
    """Bytes of all arrays of an HDF5 file."""
    sizes: list[int] = []
    with needed_package("h5py", "MATLAB 7.3 files").File(path) as file:
        file.visititems(lambda _, entry: sizes.append(getattr(entry, "nbytes", 0)))
    return sum(sizes)


def _matlab_channels(path: str, content: Mapping[str, Any]) -> Iterator[SourceChannel]:
    """The channels of a struct, and of the structs in it."""
    units = _first(content, UNIT_FIELDS)
    units = units if isinstance(units, Mapping) else {}
    for name, value in content.items():
        if not name.startswith(("__", "#")):  # HDF5 keeps MATLAB's objects behind a #
            full = f"{path}.{name}" if path else name
            yield from _matlab_field(path, full, value, units.get(name))
    if _first(content, TIME_FIELDS) is None and (steady := _times_of_interval(content)) is not None:
        yield from _matlab_columns(path, f"{path}.time" if path else "time", steady, "s")


def _matlab_field(path: str, full: str, value: Any, unit: Any) -> Iterator[SourceChannel]:
    """The channels of one field of a struct; path: of the struct, full: of the field."""
    if isinstance(value, Mapping):
        value = _struct_array(full, value)
    if isinstance(value, Mapping) and _first(value, VALUE_FIELDS) is not None:
        yield from _single(path, full, value)
    elif isinstance(value, Mapping):
        yield from _matlab_channels(full, value)
    elif isinstance(value, list) or (
        type(value) is np.ndarray and value.dtype == object and value.ndim == 1  # a cell array
    ):
        for number, one in enumerate(value, start=1):
            named = isinstance(one, Mapping) and _first(one, NAME_FIELDS)
            yield from _matlab_field(path, str(named or f"{full}({number})"), one, "")
    elif isinstance(value, np.ndarray):
        yield from _matlab_columns(path, full, value, unit)


def _struct_array(name: str, struct: Mapping[str, Any]) -> Any:
    """A list of structs for a struct of lists, as 7.3 has arrays, and for Simulink's only signal."""
    if isinstance(_first(struct, VALUE_FIELDS), list):
        lists = {key: value for key, value in struct.items() if isinstance(value, list)}
        return [dict(zip(lists, one, strict=True)) for one in zip(*lists.values(), strict=True)]
    return [struct] if name.endswith("signals") else struct


def _matlab_columns(path: str, name: str, value: NDArray, unit: Any) -> Iterator[SourceChannel]:
    """The vectors of a numeric array: its columns, or its rows where these are longer."""
    if type(value).__name__ in OBJECTS:
        yield unread(name, "is a MATLAB object: save its numbers as vectors", path)
    value = np.squeeze(value)
    if value.dtype.kind == "c":
        yield unread(name, "holds complex numbers: save their real part", path)
    if value.dtype.kind not in "iufb" or value.ndim not in (1, 2) or value.shape[0] < 2:
        return
    rows = np.atleast_2d(value if value.ndim == 1 or value.shape[0] < value.shape[1] else value.T)
    for number, row in enumerate(rows, start=1):
        yield SourceChannel(
            name=name if len(rows) == 1 else f"{name}({number})",
            unit=unit if isinstance(unit, str) else "",
            values=np.asarray(row, dtype=float),
            table=path,
        )


def _single(path: str, name: str, content: Mapping[str, Any]) -> Iterator[SourceChannel]:
    """A struct that holds one channel, perhaps with its own time."""
    time = _first(content, TIME_FIELDS)
    time = _times_of_interval(content) if time is None else np.asarray(time)
    table = path if time is None else name
    values = np.asarray(_first(content, VALUE_FIELDS))
    yield from _matlab_columns(table, name, values, _first(content, UNIT_FIELDS))
    if time is not None:
        yield from _matlab_columns(table, f"{name}.time", time, "")


def _times_of_interval(content: Mapping[str, Any]) -> NDArray | None:
    """Times that a struct gives by start and interval, (samples,) [s]; None: it does not."""
    interval, start = _first(content, INTERVAL_FIELDS), _first(content, START_FIELDS)
    count = max((np.size(value) for value in content.values() if np.ndim(value) == 1), default=0)
    if not isinstance(interval, int | float) or count < 2:
        return None
    return (start if isinstance(start, int | float) else 0.0) + interval * np.arange(count)


def _first(content: Mapping[str, Any], names: tuple[str, ...]) -> Any:
    """The first of these fields that a struct has, whatever its case; None if it has none."""
    return next((value for key, value in content.items() if key.lower() in names), None)
