"""`import_campaign`: measurement files of a bench become a campaign."""

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pandas as pd

from epv_env.common.files import LARGEST_FILE
from epv_env.common.units import BAR
from identification.importing.binary_files import read_matlab, read_mdf, read_parquet, read_tdms
from identification.importing.channels import MappedChannel, mapped_channels, supply_pair_mean
from identification.importing.common_grid import GriddedSignals, on_common_grid, usual_rate
from identification.importing.mapping_file import MappingFile, RecordingEntry, meaning, read_mapping
from identification.importing.source_file import ImportingError, SourceFile
from identification.importing.text_files import read_text
from identification.recordings.plausibility import switches
from identification.recordings.recording import CHANNELS, RULES, Campaign, Recording, RecordingRules

FORMATS = (
    ("MDF", read_mdf, (".mf4", ".mdf", ".dat")),
    ("MATLAB", read_matlab, (".mat",)),
    ("TDMS", read_tdms, (".tdms",)),
    ("Parquet", read_parquet, (".parquet", ".pq")),
    ("text", read_text, (".csv", ".txt", ".tsv", ".asc", ".lvm")),
)
"""Name, reader and suffixes of every format. A new one is a reader and a line here.

A reader takes a path and returns the version or dialect, and the channels; it may raise ImportingError.
"""

USUAL_TEMPERATURE, USUAL_PRESSURE = 293.0, 1.0 * BAR
"""Ambient conditions that are assumed, and said to be, where nobody gives them [K, Pa absolute]."""


@dataclass(frozen=True, kw_only=True)
class ImportedFile:
    """One measurement file and the recording that it became."""

    source: SourceFile
    channels: tuple[MappedChannel, ...]
    gridded: GriddedSignals
    recording: Recording


@dataclass(frozen=True, kw_only=True)
class ImportedCampaign:
    """What the measurement files became."""

    campaign: Campaign
    files: tuple[ImportedFile, ...]
    assumptions: tuple[str, ...]
    """What nobody said and the import took for granted, a sentence each."""

    def provenance(self) -> dict[str, Any]:
        """Where each recording comes from and what was done to it, for campaign.json."""
        files = [
            {
                "recording": file.recording.name,
                "source": file.source.path.name,
                "sha256": file.source.sha256,
                "format": file.source.format,
                "rate_Hz": 1.0 / file.gridded.period,
                "channels": {
                    channel.name: {
                        "source": channel.source.name,
                        "unit": channel.unit.text,
                        **({"reference": channel.reference} if channel.reference else {}),
                        "to_SI": channel.conversion,
                        "resampled": channel.name in file.gridded.resampled,
                        "held": channel.name in file.gridded.held,
                        "filled": channel.filled,
                    }
                    for channel in file.channels
                },
            }
            for file in self.files
        ]
        assumptions = list(self.assumptions)
        return {"made_by": "python -m identification import", "assumptions": assumptions, "files": files}


def read_files(
    files: Sequence[str | PathLike[str]],
    *,
    mapping: str | PathLike[str] | MappingFile | None = None,
    ambient_bar: float | None = None,
    temperature_K: float | None = None,
    rate: float | None = None,
    name: str | None = None,
    gauge: bool = False,
    rules: RecordingRules = RULES,
) -> ImportedCampaign:
    """The campaign that measurement files make, in memory.

    Args:
        files: MDF, MATLAB, TDMS, Parquet or text; each becomes one recording.
        mapping: a mapping file or its content, for what names and units do not say.
        ambient_bar: p_env [bar absolute]; None: the mapping file's, else 1 bar, which is said.
        temperature_K: T_env [K]; None: likewise, else 293 K.
        rate: samples per second of the recordings [1/s]; None: of each file's slowest channel.
        name: of the campaign; None: that of the first file's folder.
        gauge: whether pressures are gauge where neither unit nor mapping file says gauge or absolute.
        rules: by which the recordings are checked (`rules_of` for another valve than the report's).

    Raises:
        ImportingError: a file cannot be read, or a channel's meaning, unit or time is unclear.
        ValueError: the mapping file is wrong.
    """
    content = mapping if isinstance(mapping, MappingFile) else MappingFile()
    if isinstance(mapping, str | PathLike):
        content = read_mapping(Path(mapping))
    content = msgspec.structs.replace(content, gauge=gauge or content.gauge)
    sources = [read_source(Path(file)) for file in files]
    names = [source.path.name for source in sources]
    for entry in content.recordings:
        if entry not in names:
            raise ImportingError(
                f"the mapping file's recordings name {entry!r}, which is not among {', '.join(names)}: "
                "give that file, too, or take it out"
            )
    pressure = content.environment.pressure_bar if ambient_bar is None else ambient_bar
    temperature = content.environment.temperature_K if temperature_K is None else temperature_K
    given = None if pressure is None else round(pressure * BAR, 6)
    imported = tuple(_imported(source, content, given, rate) for source in sources)
    campaign = Campaign(
        name=name or Path(files[0]).resolve().parent.name or "bench run",
        temperature=USUAL_TEMPERATURE if temperature is None else temperature,
        pressure=USUAL_PRESSURE if given is None else given,
        recordings=tuple(file.recording for file in imported),
        rules=rules,
    )
    assumptions = _assumptions(imported, content, pressure, temperature)
    return ImportedCampaign(campaign=campaign, files=imported, assumptions=assumptions)


def _imported(
    source: SourceFile,
    content: MappingFile,
    ambient: float | None,
    rate: float | None,
) -> ImportedFile:
    """One file as a recording; ambient: p_env [Pa absolute], None if nobody gave it."""
    channels = mapped_channels(source, content, ambient)
    gridded = on_common_grid(str(source.path), channels, rate)
    signals: dict[str, Any] = supply_pair_mean(gridded.signals)
    entry = content.recordings.get(source.path.name, RecordingEntry())
    named_so = re.search("(?<![a-z])valid", source.path.stem.lower())
    proposed = "validation" if named_so else "calibration"
    recording = Recording(
        name=entry.name or source.path.stem,
        role=entry.role or (proposed if switches(signals["U"]) else "quality"),
        period=gridded.period,
        sigma_S=signals.get("sigma_S", np.zeros_like(signals["U"])),
        **{name: signals[name] for name in CHANNELS},
    )
    return ImportedFile(source=source, channels=tuple(channels), gridded=gridded, recording=recording)


def _assumptions(
    files: Sequence[ImportedFile],
    content: MappingFile,
    pressure: float | None,
    temperature: float | None,
) -> tuple[str, ...]:
    silent = {c.source.name for f in files for c in f.channels if c.reference == "absolute, assumed"}
    unsaid = [f for f in files if not content.recordings.get(f.source.path.name, RecordingEntry()).role]
    roles = ", ".join(f"{file.recording.name} {file.recording.role}" for file in unsaid)
    sentences = {
        f"ambient pressure {USUAL_PRESSURE / BAR:g} bar (give --ambient-bar)": pressure is None,
        f"ambient temperature {USUAL_TEMPERATURE:g} K (give --temperature-K)": temperature is None,
        f"{', '.join(sorted(silent))} absolute, since the unit does not say gauge": bool(silent),
        f"roles by name and voltage: {roles}": bool(unsaid),
    }
    return tuple(sentence for sentence, assumed in sentences.items() if assumed)


def read_source(path: Path) -> SourceFile:
    """The channels of a measurement file. Raises ImportingError."""
    known = {suffix: (name, read) for name, read, suffixes in FORMATS for suffix in suffixes}
    if not path.is_file():
        state = "is no regular file" if path.exists() else "does not exist"
        state = "is a folder" if path.is_dir() else state
        raise ImportingError(f"{path} {state}: give the path of a measurement file")
    if path.suffix.lower() not in known:
        raise ImportingError(
            f"{path} has no suffix of a known kind: give one of {', '.join(sorted(known))}"
        )
    kind, read = known[path.suffix.lower()]
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise ImportingError(
                f"{path} is larger than {LARGEST_FILE:,} bytes: export the bench's channels alone, or "
                "cut the recording"
            )
        with path.open("rb") as stream:
            sha256 = hashlib.file_digest(stream, "sha256").hexdigest()
        version, channels = read(path)
    except ImportingError:
        raise
    except OSError as error:
        reason = error.strerror or str(error).splitlines()[0][:160]
        raise ImportingError(f"{path} cannot be read ({reason}): export it anew") from None
    except Exception as error:  # the formats' packages raise whatever they like on damaged files
        reason = (str(error).splitlines() or [type(error).__name__])[0][:160]
        raise ImportingError(f"{path} is damaged or no {kind} file ({reason}): export it anew") from None
    if not any(channel.known.size for channel in channels):
        others = ", ".join(channel.name for channel in channels[:20]) or "nothing"
        raise ImportingError(
            f"{path}: no series of numbers in it, but {others}: export the channels as numbers"
        )
    return SourceFile(path=path, format=version, sha256=sha256, channels=tuple(channels))


def source_table(source: SourceFile) -> str:
    """The channels of a file: name, unit, range, rate, and what its name means."""
    rows = []
    for channel in source.channels:
        known, time = channel.known, channel.time
        rows.append(
            {
                "channel": source.label(channel),
                "unit": channel.unit,
                "range": f"{np.min(known):.5g} to {np.max(known):.5g}" if len(known) else "empty",
                "rate": f"{usual_rate(time):.6g} Hz"
                if time is not None and time.size and np.ptp(time) > 0
                else "",
                "proposed": meaning(channel.name, channel.unit) or "",
            }
        )
    return f"{source.path} ({source.format})\n{pd.DataFrame(rows).to_string(index=False)}"


def import_text(imported: ImportedCampaign) -> str:
    """What every file becomes, and what was assumed."""
    parts = []
    for file in imported.files:
        gridded, recording = file.gridded, file.recording
        treated = dict.fromkeys(gridded.resampled, "resampled") | dict.fromkeys(gridded.held, "held")
        rows = [
            {
                "becomes": channel.name,
                "channel": channel.source.name,
                "unit": f"{channel.unit.text} {channel.reference}".strip(),
                "to SI": channel.conversion,
                "rate": f"{usual_rate(channel.time):.6g} Hz",
                "samples": treated.get(channel.name, "as recorded")
                + (f", {channel.filled} missing filled" if channel.filled else ""),
            }
            for channel in file.channels
        ]
        lines = [
            f"{file.source.path.name} -> {recording.name}.csv, role {recording.role}, "
            f"{len(recording)} samples at {1 / recording.period:.6g} Hz",
            pd.DataFrame(rows).to_string(index=False),
        ]
        for names, what in (
            (gridded.resampled, "other times than the file's, low-pass filtered"),
            (gridded.held, "other times than the file's, each sample is the last entry before it"),
        ):
            lines += [f"{', '.join(names)}: {what}"] if names else []
        parts.append("\n".join(lines))
    return "\n\n".join([*parts, "\n".join(f"assumed: {it}" for it in imported.assumptions)])
