"""One recording with times as tools write them: per channel, as points in time, at two rates."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from identification.recordings.recording import Recording
from tests.identification.importing.dialects import Columns, columns_of, mat5, mat73, named

NOON = np.datetime64("2026-03-01T12:00:00", "ns")
"""Point in time of a recording's first sample."""

LEAD = 8
"""Samples by which current and voltage are recorded before the pressures, where they start apart."""


def channels_of(recording: Recording) -> Columns:
    """The channels of `columns_of` without the time."""
    return {name: pair for name, pair in columns_of(recording).items() if name != "time"}


def stamps(recording: Recording) -> NDArray:
    """Points in time of the samples."""
    return NOON + np.round(recording.time * 1e9).astype("timedelta64[ns]")


def structs(recording: Recording, every: int = 1) -> dict[str, Any]:
    """MATLAB structs with a time vector of their own; of the pressures every n-th sample."""
    return {
        name: {
            "data": values[:: every if name.startswith("p") else 1],
            "time": recording.time[:: every if name.startswith("p") else 1],
            "unit": unit,
        }
        for name, (values, unit) in channels_of(recording).items()
    }


def time_beside(recording: Recording) -> dict[str, Any]:
    """A time vector beside the struct that holds the channels."""
    return {"t": recording.time, "data": named(channels_of(recording))}


def frame(recording: Recording, time: Any) -> pd.DataFrame:
    """A table with units in its names."""
    values = {f"{n} [{u}]": own for n, (own, u) in channels_of(recording).items()}
    return pd.DataFrame({"time": time, **values})


def csv(path: Path, table: pd.DataFrame) -> Path:
    path = path.with_suffix(".csv")
    table.to_csv(path, index=False)
    return path


def parquet(path: Path, table: pd.DataFrame) -> Path:
    path = path.with_suffix(".parquet")
    table.to_parquet(path)
    return path


def zoned(recording: Recording, zone: str) -> list[str]:
    """ISO 8601 with a zone."""
    return [f"{stamp}{zone}" for stamp in stamps(recording)]


def every_other_empty(table: pd.DataFrame) -> pd.DataFrame:
    """A table in which the pressures have a value in every other row."""
    slow = [name for name in table if str(name).startswith("p")]
    return table.assign(**{name: table[name].where(table.index % 2 == 0) for name in slow})


def tdms(path: Path, recording: Recording, *, waveform: bool, every: int = 1, lead: int = 0) -> Path:
    """Current and voltage, and pressures that start later and are sampled less often."""
    from nptdms import ChannelObject, TdmsWriter

    path = path.with_suffix(".tdms")
    time, objects = stamps(recording), []
    for group, first, step in (("electrical", 0, 1), ("pressures", lead, every)):
        times = time[first::step]
        if not waveform:
            objects.append(ChannelObject(group, "time", times))
        for name, (values, unit) in channels_of(recording).items():
            if name.startswith("p") == (group == "pressures"):
                properties: dict[str, Any] = {"unit_string": unit}
                if waveform:
                    properties |= {
                        "wf_increment": recording.period * step,
                        "wf_start_offset": 0.0,
                        "wf_start_time": times[0],
                    }
                objects.append(ChannelObject(group, name, values[first::step], properties=properties))
    with TdmsWriter(path) as writer:
        writer.write_segment(objects)
    return path


SAME_RATE: dict[str, Callable[[Path, Recording], Path]] = {
    "MATLAB 5, a time per channel": lambda at, r: mat5(at, structs(r)),
    "MATLAB 7.3, a time per channel": lambda at, r: mat73(at, structs(r)),
    "MATLAB 5, in a struct": lambda at, r: mat5(at, {"log": structs(r)}),
    "MATLAB 7.3, in a struct": lambda at, r: mat73(at, {"log": structs(r)}),
    "MATLAB 5, time beside the struct": lambda at, r: mat5(at, time_beside(r)),
    "MATLAB 7.3, time beside the struct": lambda at, r: mat73(at, time_beside(r)),
    "text, ISO 8601": lambda at, r: csv(at, frame(r, stamps(r))),
    "text, ISO 8601 with a zone": lambda at, r: csv(at, frame(r, zoned(r, "+02:00"))),
    "text, basic ISO 8601": lambda at, r: csv(
        at, frame(r, [text.replace("-", "").replace(":", "") for text in zoned(r, "Z")])
    ),
    "Parquet, points in time": lambda at, r: parquet(at, frame(r, stamps(r))),
    "Parquet, texts": lambda at, r: parquet(at, frame(r, zoned(r, ""))),
    "TDMS, points in time": lambda at, r: tdms(at, r, waveform=False),
    "TDMS, waveforms": lambda at, r: tdms(at, r, waveform=True),
}
"""Writers of files whose channels have one rate."""

TWO_RATES: dict[str, Callable[[Path, Recording], Path]] = {
    "MATLAB 5": lambda at, r: mat5(at, structs(r, every=2)),
    "MATLAB 7.3": lambda at, r: mat73(at, structs(r, every=2)),
    "text": lambda at, r: csv(at, every_other_empty(frame(r, stamps(r)))),
    "Parquet": lambda at, r: parquet(at, every_other_empty(frame(r, stamps(r)))),
    "TDMS, points in time": lambda at, r: tdms(at, r, waveform=False, every=2),
    "TDMS, waveforms": lambda at, r: tdms(at, r, waveform=True, every=2),
}
"""Writers of files whose pressures have half the rate of current and voltage."""
