"""`read_files`: measurement files of a bench become a campaign."""

import hashlib
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pandas as pd

from epv_env.common.files import read_bytes
from epv_env.common.units import BAR
from identification.importing.binary_files import read_matlab, read_mdf, read_parquet, read_tdms
from identification.importing.channels import MappedChannel, mapped_channels
from identification.importing.common_grid import on_common_grid
from identification.importing.mapping_file import FORMAT, MappingFile, meaning, proposed, read_mapping
from identification.importing.source_file import NO_NUMBERS, ImportingError, SourceFile, usable
from identification.importing.text_files import read_text
from identification.recordings.columns import Place
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
That of text takes marks of missing readings, too.
"""

USUAL_TEMPERATURE, USUAL_PRESSURE = 293.0, 1.0 * BAR
"""Ambient conditions that are assumed, and said to be, where nobody gives them [K, Pa absolute]."""


@dataclass(frozen=True, kw_only=True)
class ImportedFile:
    """One measurement file and the recording that it became."""

    source: SourceFile
    channels: Sequence[MappedChannel]
    recording: Recording

    def rows(self) -> list[dict[str, str]]:
        """What became of each channel, as texts by heading."""
        return [
            {
                "becomes": channel.name,
                "channel": channel.source.full_name,
                "unit": f"{channel.unit.text} {channel.reference}".strip(),
                "to SI": channel.conversion,
                "rate": f"{channel.rate:.6g} Hz",
                "samples": channel.treated
                + (f", {channel.filled} missing filled" if channel.filled else "")
                + (f", {channel.left} missing at the ends left out" if channel.left else ""),
            }
            for channel in self.channels
        ]


@dataclass(frozen=True, kw_only=True)
class ImportedCampaign:
    """What the measurement files became."""

    campaign: Campaign
    files: tuple[ImportedFile, ...]
    assumptions: tuple[str, ...]
    """What nobody said and the import took for granted, a sentence each."""

    @property
    def places(self) -> dict[str, Place]:
        """What messages call the recordings, by name: measurement files with their lines, or times."""
        found = {}
        for file in self.files:
            told = [c.lines for c in file.channels if c.lines is not None and not file.source.joined]
            where: dict[str, Any] = {"lines": told[0]} if told else {"period": file.recording.period}
            found[file.recording.name] = Place(file=str(file.source.path), **where)
        return found

    def provenance(self) -> dict[str, Any]:
        """Where each recording comes from and what was done to it, for campaign.json."""
        files = [
            {
                "recording": file.recording.name,
                "sources": {s.path.name: s.sha256 for s in (file.source, *file.source.joined)},
                "format": file.source.format,
                "rate_Hz": 1.0 / file.recording.period,
                "channels": file.rows(),
            }
            for file in self.files
        ]
        return {"made_by": "epv import", "assumptions": list(self.assumptions), "files": files}


def read_files(
    files: Sequence[str | PathLike[str] | SourceFile],
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
        files: MDF, MATLAB, TDMS, Parquet or text, or what `read_source` made of them; each becomes one
            recording, unless the mapping file joins it to another.
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
    sources = joined(
        [f if isinstance(f, SourceFile) else read_source(Path(f), content.missing) for f in files],
        content,
    )
    pressure = content.environment.pressure_bar if ambient_bar is None else ambient_bar
    temperature = content.environment.temperature_K if temperature_K is None else temperature_K
    given = None if pressure is None else round(pressure * BAR, 6)
    imported = tuple(_imported(source, sources, content, given, rate) for source in sources)
    campaign = Campaign(
        name=name or sources[0].path.resolve().parent.name or "bench run",
        temperature=USUAL_TEMPERATURE if temperature is None else temperature,
        pressure=USUAL_PRESSURE if given is None else given,
        recordings=tuple(file.recording for file in imported),
        rules=rules,
    )
    assumptions = _assumptions(imported, content, pressure, temperature)
    return ImportedCampaign(campaign=campaign, files=imported, assumptions=assumptions)


def joined(sources: Sequence[SourceFile], content: MappingFile) -> list[SourceFile]:
    """The files, with the channels of those that the mapping file joins. Raises ImportingError."""
    known = {source.path.name: source for source in sources}
    others = [other for entry in content.recordings.values() for other in entry.join]
    for named in (*content.recordings, *others):
        if named not in known:
            raise ImportingError(
                f"the mapping file's recordings name {named!r}, which is not among {', '.join(known)}: "
                "give that file, too, or take it out"
            )
    if chained := [file for file, entry in content.recordings.items() if entry.join and file in others]:
        raise ImportingError(
            f"the mapping file joins {chained[0]} to itself or to a file that is joined: name all files "
            "of a recording at the first of them"
        )
    own = [source for source in sources if source.path.name not in others]
    return [
        replace(
            source,
            channels=tuple(
                replace(channel, file=part.path.name if parts else "")
                for part in (source, *parts)
                for channel in part.channels
            ),
            joined=parts,
        )
        for source in own
        for parts in [tuple(known[other] for other in content.recording(source.path).join)]
    ]


def _imported(
    source: SourceFile,
    sources: Sequence[SourceFile],
    content: MappingFile,
    ambient: float | None,
    rate: float | None,
) -> ImportedFile:
    """One of the files as a recording; ambient: p_env [Pa absolute], None if nobody gave it."""
    known = {*proposed(source.channels), *(n for n, e in content.channels.items() if e.source)}
    missing = [name for name in CHANNELS if name not in known]
    holding = [s.path.name for s in sources if {*missing} & set(proposed(s.channels))]
    if holding:
        example = {"format": FORMAT, "recordings": {source.path.name: {"join": holding}}}
        raise ImportingError(
            f"{source.path} has no {', '.join(missing)}, which {', '.join(holding)} may hold: if "
            f"these are one recording, join them in a mapping file such as {json.dumps(example)}"
        )
    channels = mapped_channels(source, content, ambient)
    period, channels = on_common_grid(source.path, channels, rate)
    signals: dict[str, Any] = {channel.name: channel.values for channel in channels}
    entry = content.recording(source.path)
    named_so = re.search("(?<![a-z])valid", source.path.stem.lower())
    role = "validation" if named_so else "calibration"
    recording = Recording(
        name=entry.name or source.path.stem,
        role=entry.role or (role if switches(signals["U"]) else "quality"),
        period=period,
        sigma_S=np.zeros_like(signals["U"]),
        **signals,
    )
    return ImportedFile(source=source, channels=channels, recording=recording)


def _assumptions(
    files: Sequence[ImportedFile],
    content: MappingFile,
    pressure: float | None,
    temperature: float | None,
) -> tuple[str, ...]:
    silent = {c.source.name for f in files for c in f.channels if c.reference == "absolute, assumed"}
    unsaid = [file for file in files if not content.recording(file.source.path).role]
    roles = ", ".join(f"{file.recording.name} {file.recording.role}" for file in unsaid)
    sentences = {
        f"ambient pressure {USUAL_PRESSURE / BAR:g} bar (give --ambient-bar)": pressure is None,
        f"ambient temperature {USUAL_TEMPERATURE:g} K (give --temperature-K)": temperature is None,
        f"{', '.join(sorted(silent))} absolute, since the unit does not say gauge": bool(silent),
        f"roles by name and voltage: {roles}": bool(unsaid),
    }
    return tuple(sentence for sentence, assumed in sentences.items() if assumed)


def read_source(path: Path, missing: Sequence[str] = ()) -> SourceFile:
    """The channels of a measurement file; missing: marks of missing readings. Raises ImportingError."""
    known = {suffix: (name, read) for name, read, suffixes in FORMATS for suffix in suffixes}
    if path.suffix.lower() not in known:
        raise ImportingError(
            f"{path} has no suffix of a known kind: give one of {', '.join(sorted(known))}"
        )
    kind, read = known[path.suffix.lower()]
    try:
        sha256 = hashlib.sha256(read_bytes(path)).hexdigest()
        version, channels = read_text(path, missing) if read is read_text else read(path)
    except ImportingError:
        raise
    except OSError as error:
        reason = error.strerror or str(error).splitlines()[0][:160]
        raise ImportingError(f"{path} cannot be read ({reason}): give a measurement file") from None
    except Exception as error:  # the formats' packages raise whatever they like on damaged files
        reason = (str(error).splitlines() or [type(error).__name__])[0][:160]
        raise ImportingError(f"{path} is damaged or no {kind} file ({reason}): export it anew") from None
    found = tuple(usable(channel, missing) for channel in channels)
    if not any(channel.known.size for channel in found):
        fault = next((channel.fault for channel in found if channel.fault), f"it {NO_NUMBERS}")
        raise ImportingError(f"{path}, {fault}")
    return SourceFile(path=path, format=version, sha256=sha256, channels=found)


def source_table(source: SourceFile) -> str:
    """The channels of a file: name, unit, range, and what its name means."""
    rows = []
    for channel in source.channels:
        known = channel.known
        rows.append(
            {
                "channel": source.label(channel),
                "unit": channel.unit,
                "range": f"{np.min(known):.5g} to {np.max(known):.5g}" if len(known) else "empty",
                "proposed": meaning(channel.name, channel.unit) or "",
            }
        )
    return f"{source.path} ({source.format})\n{pd.DataFrame(rows).to_string(index=False)}"


def import_text(imported: ImportedCampaign) -> str:
    """What every file becomes, and what was assumed."""
    parts = [
        f"{file.source.path.name} -> {file.recording.name}.csv, role {file.recording.role}, "
        f"{len(file.recording)} samples at {1 / file.recording.period:.6g} Hz\n"
        f"{pd.DataFrame(file.rows()).to_string(index=False)}"
        for file in imported.files
    ]
    return "\n\n".join([*parts, "\n".join(f"assumed: {it}" for it in imported.assumptions)])
