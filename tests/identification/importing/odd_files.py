"""A recording in files as tools and people leave them: odd headers, cut lines, structs, groups."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from epv_env.common.files import LARGEST_FILE
from identification.recordings.recording import Recording
from tests.identification.importing.dialects import columns_of, mat5, named, text
from tests.identification.importing.timed_files import channels_of, frame


def rows(
    at: Path, true: Recording, head: list[str], *, sep: str = ";", end: str = "", last: str = ""
) -> Path:
    """Lines of a head, then of numbers that end as told, then a last one."""
    at = at if at.suffix else at.with_suffix(".csv")
    values = np.transpose([values for values, _ in columns_of(true).values()])
    lines = [sep.join(f"{value:.9f}" for value in row) + end for row in values]
    at.write_text("\n".join([*head, *lines, last]))
    return at


NAMES, UNITS = ["time", "I", "U", "p1", "p2", "p3"], ["s", "A", "V", "bar", "bar", "bar"]
BRACKETED = ";".join(f"{name} [{unit}]" for name, unit in zip(NAMES, UNITS, strict=True))


def lvm(at: Path, true: Recording) -> Path:
    head = ["LabVIEW Measurement\t", "Operator\tbench", "***End_of_Header***\t", "\t",
            "Channels\t5\t\t\t\t\t", "Samples" + 5 * "\t9", "Y_Unit_Label\t" + "\t".join(UNITS[1:]),
            "***End_of_Header***\t\t\t\t\t", "\t".join(["X_Value", *NAMES[1:], "Comment"])]  # fmt: skip
    return rows(at.with_suffix(".lvm"), true, head, sep="\t")


def three_header_rows(at: Path, true: Recording) -> Path:
    head = [
        "record\tTab",
        "\t".join([*NAMES, ""]),
        6 * "f8\t",
        "\t".join(f'"{u}"' for u in UNITS) + "\t",
    ]
    return rows(at.with_suffix(".asc"), true, head, sep="\t", end="\t")


def waveforms(at: Path, true: Recording, **properties: Any) -> Path:
    """TDMS of another increment than SI, or without an offset, beside a spectrum."""
    from nptdms import ChannelObject, TdmsWriter

    objects = [
        ChannelObject("Log", name, values, properties={"unit_string": unit, **properties})
        for name, (values, unit) in channels_of(true).items()
    ]
    spectrum = {"wf_increment": 10.0, "wf_xunit_string": "Hz"}
    with TdmsWriter(at.with_suffix(".tdms")) as writer:
        writer.write_segment([*objects, ChannelObject("FFT", "spectrum", true.U, properties=spectrum)])
    return at.with_suffix(".tdms")


def decimals(at: Path, true: Recording) -> Path:
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.Table.from_pandas(frame(true, true.time).rename(columns={"time": "time [s]"}))
    column = table.column("p2 [bar]").cast(pa.decimal128(18, 9), safe=False)
    pq.write_table(table.set_column(table.schema.get_field_index("p2 [bar]"), "p2 [bar]", column),
                   at.with_suffix(".parquet"))  # fmt: skip
    return at.with_suffix(".parquet")


def struct_array(true: Recording) -> dict[str, Any]:
    """Signals in an array of structs, their times in another struct."""
    kind = [("Name", "O"), ("Unit", "O"), ("Data", "O")]
    signals = [(name, unit, values) for name, (values, unit) in channels_of(true).items()]
    return {
        "run7": {
            "X": {"Name": "Raster", "Unit": "s", "Data": true.time},
            "Y": np.array(signals, dtype=kind),
        }
    }


def interval(true: Recording) -> dict[str, Any]:
    length = {"Tstart": -0.02, "Tinterval": true.period, "Length": float(len(true))}
    return length | named(channels_of(true))


def written(at: Path, content: str) -> Path:
    at.write_text(content)
    return at


def simulink(true: Recording) -> dict[str, Any]:
    kind = [("values", "O"), ("label", "O"), ("dimensions", "O")]
    signals = [(values, f"{name}_{unit}", 1.0) for name, (values, unit) in channels_of(true).items()]
    return {"out": {"time": true.time, "signals": np.array(signals, dtype=kind)}}


def timed(at: Path, true: Recording, time: Any, *, sep: str = ";", decimal: str = ".") -> Path:
    """A text table whose first columns are times as some tool writes them."""
    table = frame(true, true.time).drop(columns="time")
    columns = time if isinstance(time, dict) else {"time": time}
    text = pd.DataFrame(columns).join(table).to_csv(index=False, sep=sep, decimal=decimal)
    return written(at.with_suffix(".csv"), text)


def clock(true: Recording, form: str, begin: str = "2026-03-01T23:59:59.9") -> list[str]:
    """Points in time in a form of strftime, with a fraction of six digits."""
    return [f"{t:{form}}" for t in pd.date_range(begin, periods=len(true), freq=f"{true.period}s")]


def multi(at: Path, true: Recording, begin: str = "Time" + 5 * "\t10:00:00.0") -> Path:
    """LabVIEW's X_Columns Multi: a column of times before each channel."""
    head = ["X_Columns\tMulti", "***End_of_Header***", "Date" + 5 * "\t2026/03/01",
            begin, "\t".join(["Y_Unit_Label", *UNITS[1:]]),
            "\t".join(f"X_Value\t{name}" for name in NAMES[1:]) + "\tComment"]  # fmt: skip
    values = np.transpose([v for name in NAMES[1:] for v in (true.time, columns_of(true)[name][0])])
    lines = ["\t".join(f"{value:.6f}" for value in row) for row in values]
    return written(at.with_suffix(".lvm"), "\n".join([*head, *lines, ""]))


def words(at: Path, true: Recording) -> Path:
    """Some cells hold a word for a missing reading, and some rows a decimal comma among points."""
    lines = rows(at, true, [BRACKETED]).read_text().splitlines()
    for k, word in enumerate(["NaN", "NULL", "#NV", "---", "Inf", "", "1.#INF", "#DIV/0!"]):
        cells = lines[20 + 40 * k].split(";")
        lines[20 + 40 * k] = ";".join([*cells[:3], word, *cells[4:]])  # p1, which is steady
        lines[21 + 40 * k] = lines[21 + 40 * k].replace(".", ",")
    return written(at.with_suffix(".csv"), "\n".join([*lines, ""]))


def restarted(at: Path, true: Recording) -> Path:
    return timed(at, true, {"time [s]": np.where(true.time < 0.3, true.time, true.time - 0.3)})


def nanoseconds(at: Path, true: Recording) -> Path:
    """MDF with unsigned integers of nanoseconds and a linear conversion to seconds as times."""
    from asammdf import MDF, Signal

    conversion = {"a": 1e-9, "b": 0.0}
    count = np.round(1e9 * true.time).astype("u8") + 1_772_359_200_000_000_000
    signals = [
        Signal(
            samples=count if name == "time" else values,
            timestamps=true.time,
            name=f"{name}_",
            unit=unit,
            conversion=conversion if name == "time" else None,  # type: ignore[arg-type]
        )
        for name, (values, unit) in columns_of(true).items()
    ]
    with MDF(version="4.10") as file:
        file.append(signals)
        return Path(file.save(at.with_suffix(".mf4"), overwrite=True))


READ: dict[str, Callable[[Path, Recording], Path]] = {
    "LabVIEW text with a column of comments": lvm,
    "names, types and units in three rows": three_header_rows,
    "a separator at the ends of the data": lambda at, r: rows(at, r, [BRACKETED], end=";"),
    "a separator at the end of the header": lambda at, r: rows(at, r, [BRACKETED + ";"]),
    "units in brackets twice": lambda at, r: rows(
        at, r, [BRACKETED.replace("bar", "bar[a]").replace("bar[a]", "bar(a)", 1)]
    ),
    "units of gauge pressure with a dot": lambda at, r: text(
        at, {n: (v - 1.0, "bar rel.") if u == "bar" else (v, u) for n, (v, u) in columns_of(r).items()}
    ),
    "TDMS without an offset": lambda at, r: waveforms(at, r, wf_increment=r.period),
    "TDMS in ms": lambda at, r: waveforms(
        at, r, wf_increment=1e3 * r.period, wf_start_offset=0.0, wf_xunit_string="ms"
    ),
    "TDMS whose increment is a text": lambda at, r: waveforms(at, r, wf_increment=str(r.period)),
    "Parquet with decimals": decimals,
    "MATLAB, array of structs": lambda at, r: mat5(at, struct_array(r)),
    "MATLAB, start and interval": lambda at, r: mat5(at, interval(r)),
    "MATLAB, structure with time": lambda at, r: mat5(at, simulink(r)),
    "LabVIEW text with a column of times for each channel": multi,
    "date and time of day in two columns": lambda at, r: timed(
        at, r, {"Datum": clock(r, "%d.%m.%Y"), "Zeit": clock(r, "%H:%M:%S,%f")}, decimal=","
    ),
    "German dates": lambda at, r: timed(at, r, clock(r, "%d.%m.%Y %H:%M:%S.%f")),
    "American dates": lambda at, r: timed(at, r, clock(r, "%m/%d/%Y %I:%M:%S.%f %p"), sep=","),
    "times of day past midnight": lambda at, r: timed(at, r, clock(r, "%H:%M:%S.%f"), sep="\t"),
    "words for missing readings": words,
    "five header rows": lambda at, r: rows(
        at,
        r,
        [
            "2026-03-01;10:00:00;;;;",
            ";".join(["Time", *NAMES[1:]]),
            5 * "REAL;" + "REAL",
            ";".join(UNITS),
            "DT0;DT2;DT4;DT6;DT8;DT10",
        ],
    ),
    "nanoseconds with a conversion": nanoseconds,
}


def mdf_groups(
    at: Path, true: Recording, *, invalid: slice | None = None, second: int | None = None
) -> Path:
    """MDF 4 in which readings of p2 carry the invalidation bit, or p2 stands in a second group."""
    from asammdf import MDF, Signal

    def signal(name: str, every: int = 1) -> Signal:
        values, unit = channels_of(true)[name]
        bits = np.zeros(len(values), dtype=bool)
        if name == "p2" and invalid:
            bits[invalid] = True
        given: dict[str, Any] = {"invalidation_bits": bits} if bits.any() else {}
        return Signal(
            samples=values[::every], timestamps=true.time[::every], name=name, unit=unit, **given
        )

    with MDF(version="4.10") as file:
        file.append([signal(name) for name in NAMES[1:]])
        if second is not None:
            file.append([signal("p2", every=second)])
        return Path(file.save(at.with_suffix(".mf4"), overwrite=True))


def nulls(at: Path, true: Recording) -> Path:
    table = frame(true, true.time)
    table.loc[100:130, "p2 [bar]"] = None
    table["p2 [bar]"] = (1000 * table["p2 [bar]"]).round().astype("Int64")
    table.rename(columns={"p2 [bar]": "p2 [mbar]"}).to_parquet(at.with_suffix(".parquet"))
    return at.with_suffix(".parquet")


def texts(at: Path, true: Recording) -> Path:
    """Parquet whose p2 is a column of words."""
    frame(true, true.time).assign(**{"p2 [bar]": "high"}).to_parquet(at.with_suffix(".parquet"))
    return at.with_suffix(".parquet")


def nan(at: Path, true: Recording) -> Path:
    content = interval(true)
    content["p2_bar"] = np.where(np.arange(len(true)) // 31 == 4, np.nan, content["p2_bar"])
    return mat5(at, content)


def huge(at: Path) -> Path:
    at = at.with_suffix(".csv")
    at.touch()
    os.truncate(at, LARGEST_FILE + 1)
    return at


def table(at: Path, names: list[str]) -> Path:
    pd.DataFrame(np.arange(5.0 * len(names)).reshape(5, -1), columns=names).to_csv(
        at.with_suffix(".csv"), index=False
    )
    return at.with_suffix(".csv")


TEXTS, ENDLESS = np.array(["text"], dtype=object), "a" + 10_000 * " " + "b"


def begun_apart(at: Path, true: Recording) -> Path:
    return multi(at, true, "Time\t10:00:00.0\t10:00:00.5")


def folder(at: Path) -> Path:
    at.mkdir()
    return at


def coarse(at: Path, true: Recording) -> Path:
    return text(at, {**columns_of(true), "time": (np.round(true.time, 3), "s")})


REFUSED: dict[str, tuple[Callable[[Path, Recording], Path], str]] = {
    "a record that begins again": (restarted, r"not increase after .* s \(line \d+\): cut the record"),
    "times of too few digits": (coarse, r"time does not increase after .*: print it with more digits"),
    "a time of day in seconds": (
        lambda at, r: timed(at, r, clock(r, "%H:%M:%S")),
        "does not increase .* with more digits",
    ),
    "a text called MDF": (lambda at, r: written(at.with_suffix(".mf4"), "a"), "not begin as MDF does"),
    "a folder": (
        lambda at, r: folder(at.with_suffix(".csv")), r"\(no regular file\): give a measurement file"
    ),
    "a file above the limit": (lambda at, r: huge(at), "larger than .* bytes"),
    "a line without end": (lambda at, r: written(at.with_suffix(".csv"), "1" * 10**6), "no separator"),
    "a name without end": (lambda at, r: table(at, ["time", ENDLESS]), "not used are a +: say it"),
    "LabVIEW's channels that begin apart": (begun_apart, "begin at different times of day"),
    "a MATLAB file of texts": (lambda at, r: mat5(at, {"a": TEXTS}), "holds no numbers: export it"),
}  # fmt: skip
