"""`import_campaign`: measurement files of a bench become a campaign."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import BAR
from identification.importing.common_grid import GriddedSignals, on_common_grid
from identification.importing.formats.registry import read_source
from identification.importing.formats.source_file import ImportingError, SourceFile
from identification.importing.mapping import MappedChannel, mapped_channels, supply_pair_mean
from identification.importing.mapping_file import MappingFile, RecordingEntry, read_mapping
from identification.importing.settings import IMPORT, ImportSettings
from identification.recordings.campaign_files import check_campaign, write_campaign
from identification.recordings.recording import Campaign, Recording
from identification.recordings.recording_checks import switches
from identification.recordings.rules import RULES, RecordingRules

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
        return {
            "made_by": "python -m identification import",
            "assumptions": list(self.assumptions),
            "files": [_file_provenance(file) for file in self.files],
        }


def read_files(
    files: Sequence[str | PathLike[str]],
    *,
    mapping: str | PathLike[str] | MappingFile | None = None,
    ambient_bar: float | None = None,
    temperature_K: float | None = None,
    rate: float | None = None,
    name: str | None = None,
    rules: RecordingRules = RULES,
    settings: ImportSettings = IMPORT,
) -> ImportedCampaign:
    """The campaign that measurement files make, in memory.

    Args:
        files: MDF, MATLAB, TDMS, Parquet or text; each becomes one recording.
        mapping: a mapping file or its content, for what names and units do not say.
        ambient_bar: p_env [bar absolute]; None: the mapping file's, else 1 bar, which is said.
        temperature_K: T_env [K]; None: likewise, else 293 K.
        rate: samples per second of the recordings [1/s]; None: of each file's slowest channel.
        name: of the campaign; None: that of the first file's folder.
        rules: by which the recordings are checked (`rules_of` for another valve than the report's).
        settings: of resampling.

    Raises:
        ImportingError: a file cannot be read, or a channel's meaning, unit or time is unclear.
        ValueError: the mapping file is wrong.
    """
    content = _mapping(mapping)
    sources = [read_source(Path(file)) for file in files]
    _check_mapped_files(content, sources)
    pressure = content.environment.pressure_bar if ambient_bar is None else ambient_bar
    temperature = content.environment.temperature_K if temperature_K is None else temperature_K
    given = None if pressure is None else round(pressure * BAR, 6)
    imported = tuple(_imported(source, content, given, rate, settings) for source in sources)
    campaign = Campaign(
        name=name or Path(files[0]).resolve().parent.name or "bench run",
        temperature=USUAL_TEMPERATURE if temperature is None else temperature,
        pressure=USUAL_PRESSURE if given is None else given,
        recordings=tuple(file.recording for file in imported),
        rules=rules,
    )
    assumptions = _assumptions(imported, content, pressure, temperature)
    return ImportedCampaign(campaign=campaign, files=imported, assumptions=assumptions)


def import_campaign(
    files: Sequence[str | PathLike[str]], out: str | PathLike[str], **options: Any
) -> ImportedCampaign:
    """`read_files`, written as a campaign into the folder `out`; its provenance is in campaign.json.

    options: those of `read_files`. Raises, besides what `read_files` does, CampaignError if physics or a
    rule of docs/reference/files.md contradicts a recording; then nothing is written.
    """
    imported = read_files(files, **options)
    write_campaign(imported.campaign, out, provenance=imported.provenance())
    return imported


def check_imported(imported: ImportedCampaign, out: str | PathLike[str]) -> None:
    """Every check of `import_campaign`, without writing. Raises CampaignError."""
    check_campaign(imported.campaign, Path(out))


def _mapping(mapping: str | PathLike[str] | MappingFile | None) -> MappingFile:
    if mapping is None:
        return MappingFile()
    return mapping if isinstance(mapping, MappingFile) else read_mapping(Path(mapping))


def _check_mapped_files(content: MappingFile, sources: Sequence[SourceFile]) -> None:
    names = {source.path.name for source in sources}
    for name in content.recordings:
        if name not in names:
            raise ImportingError(
                f"the mapping file's recordings name {name!r}, which is not among {', '.join(names)}: "
                "give that file, too, or take it out"
            )


def _imported(
    source: SourceFile,
    content: MappingFile,
    ambient: float | None,
    rate: float | None,
    settings: ImportSettings,
) -> ImportedFile:
    """One file as a recording; ambient: p_env [Pa absolute], None if nobody gave it."""
    channels = mapped_channels(source, content, ambient)
    gridded = on_common_grid(str(source.path), channels, rate, settings)
    signals = supply_pair_mean(gridded.signals)
    entry = content.recordings.get(source.path.name, RecordingEntry())
    recording = Recording(
        name=entry.name or source.path.stem,
        role=entry.role or _proposed_role(source.path, signals["U"]),
        period=gridded.period,
        sigma_S=signals.get("sigma_S", np.zeros_like(signals["U"])),
        I=signals["I"],
        U=signals["U"],
        p1=signals["p1"],
        p2=signals["p2"],
        p3=signals["p3"],
    )
    return ImportedFile(source=source, channels=tuple(channels), gridded=gridded, recording=recording)


def _proposed_role(path: Path, U: NDArray) -> str:
    """By the voltage, (samples,) [V], and the file's name."""
    if not switches(U, RULES):
        return "quality"
    return "validation" if "valid" in path.stem.lower() else "calibration"


def _assumptions(
    files: Sequence[ImportedFile],
    content: MappingFile,
    pressure: float | None,
    temperature: float | None,
) -> tuple[str, ...]:
    found = []
    if pressure is None:
        found.append(f"ambient pressure {USUAL_PRESSURE / BAR:g} bar (give --ambient-bar)")
    if temperature is None:
        found.append(f"ambient temperature {USUAL_TEMPERATURE:g} K (give --temperature-K)")
    silent = {c.source.name for f in files for c in f.channels if c.reference == "absolute, assumed"}
    if silent:
        found.append(f"{', '.join(sorted(silent))} absolute, since the unit does not say gauge")
    unsaid = [f for f in files if not content.recordings.get(f.source.path.name, RecordingEntry()).role]
    if unsaid:
        roles = ", ".join(f"{f.recording.name} {f.recording.role}" for f in unsaid)
        found.append(f"roles by name and voltage: {roles}")
    return tuple(found)


def _file_provenance(file: ImportedFile) -> dict[str, Any]:
    return {
        "recording": file.recording.name,
        "source": file.source.path.name,
        "sha256": file.source.sha256,
        "format": file.source.format,
        "rate_Hz": 1.0 / file.gridded.period,
        "channels": {c.name: _channel_provenance(c, file.gridded) for c in file.channels},
    }


def _channel_provenance(channel: MappedChannel, gridded: GriddedSignals) -> Mapping[str, Any]:
    return {
        "source": channel.source.name,
        "unit": channel.unit.text,
        **({"reference": channel.reference} if channel.reference else {}),
        "to_SI": channel.conversion,
        "resampled": channel.name in gridded.resampled,
    }
