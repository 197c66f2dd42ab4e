"""A campaign of the virtual bench, in the dialects of benches, and whether it comes back."""

from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
from numpy.typing import NDArray

from epv_env.plant.parameters import Parameters
from identification.bench.programmes import REPORT_SUITE
from identification.bench.session import run_bench
from identification.importing.import_campaign import ImportedCampaign, read_files
from identification.recordings.campaign_files import write_campaign
from identification.recordings.recording import CHANNELS, Campaign, Recording

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
    path = path if path.suffix else path.with_suffix(".csv")
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


def mat5(path: Path, content: Mapping[str, Any]) -> Path:
    path = path.with_suffix(".mat")
    scipy.io.savemat(path, dict(content))
    return path


def mat73(path: Path, content: Mapping[str, Any]) -> Path:
    """HDF5 as MATLAB writes it: structs are groups, texts are codes of their characters."""
    import h5py

    path = path.with_suffix(".mat")
    with h5py.File(path, "w", userblock_size=512) as file:
        _put(file, content)
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    return path


def _put(group: Any, content: Mapping[str, Any]) -> None:
    for name, value in content.items():
        if isinstance(value, Mapping):
            member = group.create_group(name)
            _put(member, value)
            kind = "struct"
        elif isinstance(value, str):
            member = group.create_dataset(name, data=np.array([[ord(c)] for c in value], np.uint16))
            member.attrs["MATLAB_int_decode"] = np.int32(2)
            kind = "char"
        else:
            member = group.create_dataset(name, data=value[None, :])
            kind = "double"
        member.attrs["MATLAB_class"] = np.bytes_(kind)


def with_units(columns: Columns) -> dict[str, Any]:
    """Values by name, and a struct of their units."""
    values = {name: own for name, (own, _) in columns.items()}
    return {**values, "units": {name: unit for name, (_, unit) in columns.items()}}


def named(columns: Columns) -> dict[str, NDArray]:
    """Values by name and unit, as MATLAB's variables have them."""
    return {f"{name}_{unit}": values for name, (values, unit) in columns.items()}


def tdms(path: Path, columns: Columns, **groups: Mapping[str, Any]) -> Path:
    """The columns in each of these groups, whose channels have the properties given by keyword."""
    from nptdms import ChannelObject, TdmsWriter

    objects = [
        ChannelObject(group, name, values, properties={"unit_string": unit, **properties})
        for group, properties in groups.items()
        for name, (values, unit) in columns.items()
    ]
    with TdmsWriter(path.with_suffix(".tdms")) as writer:
        writer.write_segment(objects)
    return path.with_suffix(".tdms")


def parquet(path: Path, columns: Columns) -> Path:
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = [pa.field(n, pa.float64(), metadata={"unit": u}) for n, (_, u) in columns.items()]
    pq.write_table(pa.table([v for v, _ in columns.values()], schema=pa.schema(fields)), path)
    return path


DIALECTS: dict[str, Callable[[Path, Recording], Path]] = {
    "MDF 4": lambda at, r: mdf(at.with_suffix(".mf4"), columns_of(r), "4.10"),
    "MDF 3": lambda at, r: mdf(at.with_suffix(".mdf"), columns_of(r), "3.30"),
    "MATLAB 5": lambda at, r: mat5(at, {"data": with_units(columns_of(r))}),
    "MATLAB 7.3": lambda at, r: mat73(at, named(columns_of(r))),
    "TDMS": lambda at, r: tdms(at, columns_of(r), bench={}),
    "Parquet": lambda at, r: parquet(at.with_suffix(".parquet"), scaled(r, "kPa")),
    "decimal comma": lambda at, r: text(at, scaled(r, "mbar", gauge=True), separator=";", decimal=","),
    "unit row and mark": lambda at, r: text(
        at, columns_of(r), unit_row=True, bracket=False, encoding="utf-8-sig"
    ),
    "comments and tabs": lambda at, r: text(
        at.with_suffix(".txt"), columns_of(r), separator="\t", head="# Prüfstand 3\n# °C\n\n",
        encoding="cp1252",
    ),
    "UTF-16": lambda at, r: text(at, scaled(r, "Pa"), separator=";", encoding="utf-16"),
    "psi": lambda at, r: text(at, scaled(r, "psi", gauge=True)),
    "MPa, preamble": lambda at, r: text(at, scaled(r, "MPa"), separator=";", head="Bench;7\nBy;N. N.\n"),
}  # fmt: skip
"""Twelve dialects: writers of one recording, by name."""


@cache
def bench() -> Campaign:
    """A test, the validation and the record at rest."""
    suite = (REPORT_SUITE[0], REPORT_SUITE[-2], REPORT_SUITE[-1])
    return run_bench(suite, Parameters.calibrated(), seed=11)


def assert_same_recordings(made: Campaign, true: Campaign) -> None:
    """Names, roles and periods are equal; pressures differ by 1 Pa at most, I and U by 1e-5 [A, V]."""
    for own, original in zip(made.recordings, true.recordings, strict=True):
        assert (own.name, own.role, own.period) == (original.name, original.role, original.period)
        for name in CHANNELS:
            atol = 1.0 if name.startswith("p") else 1e-5
            np.testing.assert_allclose(own.channel(name), original.channel(name), rtol=0, atol=atol)


def import_campaign(files, out, **options: Any) -> ImportedCampaign:
    """`read_files`, written as a campaign into the folder `out`."""
    imported = read_files(files, **options)
    write_campaign(imported.campaign, out, provenance=imported.provenance())
    return imported
