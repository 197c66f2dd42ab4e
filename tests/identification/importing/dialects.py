"""One recording written in the dialects of benches; each writer returns the file's path."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import scipy.io
from numpy.typing import NDArray

from identification.recordings.recording import Recording

Columns = dict[str, tuple[NDArray, str]]
"""Values with their unit, by name."""


def columns_of(recording: Recording) -> Columns:
    """Time and channels in the units of campaigns."""
    return {
        "time": (recording.time, "s"),
        "I": (recording.I, "A"),
        "U": (recording.U, "V"),
        **{name: (recording.channel(name) / 1e5, "bar") for name in ("p1", "p2", "p3")},
    }


def scaled(recording: Recording, pressure: str = "mbar", gauge: bool = False) -> Columns:
    """The same in ms, mA, mV and another unit of pressure."""
    size = {"mbar": 100.0, "kPa": 1e3, "psi": 6894.757293168361, "MPa": 1e6, "Pa": 1.0}[pressure]
    ambient = 1e5 if gauge else 0.0
    suffix = " gauge" if gauge else ""
    return {
        "Zeit": (recording.time * 1e3, "ms"),
        "Strom": (recording.I * 1e3, "mA"),
        "Spannung": (recording.U * 1e3, "mV"),
        **{
            name: ((recording.channel(channel) - ambient) / size, pressure + suffix)
            for name, channel in (("Vorratsdruck", "p1"), ("Kreisdruck", "p2"), ("Steuerdruck", "p3"))
        },
    }


def text(
    path: Path, columns: Columns, *, separator: str = ",", decimal: str = ".", head: str = "",
    unit_row: bool = False, bracket: bool = True, encoding: str = "utf-8",
) -> Path:  # fmt: skip
    names = [f"{n} [{u}]" if bracket else n for n, (_, u) in columns.items()]
    lines = [separator.join(names)]
    if unit_row:
        lines.append(separator.join(unit for _, unit in columns.values()))
    for row in zip(*(values for values, _ in columns.values()), strict=True):
        lines.append(separator.join(f"{value:.9f}".replace(".", decimal) for value in row))
    path.write_text(head + "\n".join(lines) + "\n", encoding=encoding)
    return path


def mdf(path: Path, columns: Columns, version: str) -> Path:
    from asammdf import MDF, Signal

    (_, (time, _)), *channels = columns.items()
    signals = [Signal(samples=v, timestamps=time, name=n, unit=u) for n, (v, u) in channels]
    with MDF(version=version) as file:
        file.append(signals)
        return Path(file.save(path, overwrite=True))


def mat5(path: Path, columns: Columns) -> Path:
    units = {name: unit for name, (_, unit) in columns.items()}
    scipy.io.savemat(path, {"data": {**{n: v for n, (v, _) in columns.items()}, "units": units}})
    return path


def mat73(path: Path, columns: Columns) -> Path:
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, (values, unit) in columns.items():
            data = file.create_dataset(f"{name}_{unit}", data=values[None, :])
            data.attrs["MATLAB_class"] = np.bytes_("double")
    header = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    with path.open("r+b") as stream:
        stream.write(header)
    return path


def tdms(path: Path, columns: Columns) -> Path:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as writer:
        writer.write_segment(
            [
                ChannelObject("bench", n, v, properties={"unit_string": u})
                for n, (v, u) in columns.items()
            ]
        )
    return path


def parquet(path: Path, columns: Columns) -> Path:
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = [pa.field(n, pa.float64(), metadata={"unit": u}) for n, (_, u) in columns.items()]
    pq.write_table(pa.table([v for v, _ in columns.values()], schema=pa.schema(fields)), path)
    return path


DIALECTS: dict[str, Callable[[Path, Recording], Path]] = {
    "MDF 4": lambda at, r: mdf(at.with_suffix(".mf4"), columns_of(r), "4.10"),
    "MDF 3": lambda at, r: mdf(at.with_suffix(".mdf"), columns_of(r), "3.30"),
    "MATLAB 5": lambda at, r: mat5(at.with_suffix(".mat"), columns_of(r)),
    "MATLAB 7.3": lambda at, r: mat73(at.with_suffix(".mat"), columns_of(r)),
    "TDMS": lambda at, r: tdms(at.with_suffix(".tdms"), columns_of(r)),
    "Parquet": lambda at, r: parquet(at.with_suffix(".parquet"), scaled(r, "kPa")),
    "decimal comma": lambda at, r: text(
        at.with_suffix(".csv"), scaled(r, "mbar", gauge=True), separator=";", decimal=","
    ),
    "unit row and mark": lambda at, r: text(
        at.with_suffix(".csv"), columns_of(r), unit_row=True, bracket=False, encoding="utf-8-sig"
    ),
    "comments and tabs": lambda at, r: text(
        at.with_suffix(".txt"), columns_of(r), separator="\t", head="# Prüfstand 3\n# °C\n\n",
        encoding="cp1252",
    ),
    "UTF-16": lambda at, r: text(
        at.with_suffix(".csv"), scaled(r, "Pa"), separator=";", encoding="utf-16"
    ),
    "psi": lambda at, r: text(at.with_suffix(".csv"), scaled(r, "psi", gauge=True)),
    "MPa, preamble": lambda at, r: text(
        at.with_suffix(".csv"), scaled(r, "MPa"), separator=";", head="Bench;7\nOperator;N. N.\n"
    ),
}  # fmt: skip
"""Twelve dialects: writers of one recording, by name."""
