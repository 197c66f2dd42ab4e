"""Campaigns as files: campaign.json and one CSV per recording (docs/reference/files.md)."""

import hashlib
import os
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.common.files import read_bytes, write_text
from epv_env.common.json_files import write_json
from epv_env.common.units import BAR
from epv_env.plant.channels import CHANNEL, MEASURED_CHANNELS, MeasuredChannel
from identification.recordings.columns import CONSUMPTION_COLUMN, TIME_COLUMN, read_columns
from identification.recordings.manifest import (
    FILE_NAME,
    check_manifest,
    manifest_content,
    read_manifest,
)
from identification.recordings.reading_steps import column_steps
from identification.recordings.recording import CHANNELS, Campaign, CampaignError, Recording
from identification.recordings.recording_checks import check_recording
from identification.recordings.rules import RULES, RecordingRules
from identification.recordings.unit_diagnosis import check_reference

DECIMALS = {
    TIME_COLUMN: 9,
    **{channel.columns[0]: channel.decimals for channel in MEASURED_CHANNELS},
    CONSUMPTION_COLUMN: 9,
}
"""Decimals written: a hundredth of an ADC step or less, and any rate's times as uniform."""


def read_campaign(folder: str | PathLike[str], rules: RecordingRules = RULES) -> Campaign:
    """The campaign in a folder, every rule of docs/reference/files.md checked. Raises CampaignError."""
    folder = Path(folder)
    manifest = read_manifest(folder)
    files = {path: _read_file(path) for path in manifest.roles}
    steps = column_steps([columns for _, columns in files.values()], rules)
    campaign = Campaign(
        name=manifest.name,
        temperature=manifest.temperature,
        pressure=manifest.pressure,
        recordings=tuple(
            _recording(path, *files[path], role, manifest.pressure, steps, rules)
            for path, role in manifest.roles.items()
        ),
        folder=folder,
        rules=rules,
    )
    check_reference(str(folder), campaign.recordings, campaign.pressure, rules)
    return campaign


def check_vacant(folder: Path) -> None:
    """Raise CampaignError if the folder holds a campaign already."""
    path = folder / FILE_NAME
    if os.path.lexists(path):
        raise CampaignError(f"{path} exists already: write to another folder, or remove that campaign")


def write_campaign(
    campaign: Campaign,
    folder: str | PathLike[str],
    *,
    provenance: Mapping[str, Any] | None = None,
) -> None:
    """Write a campaign that `read_campaign` takes; its JSON last, so that a part of one is none.

    Each file is written whole or not at all, in place of one of the same name. Raises CampaignError,
    before anything is written, if the folder holds a campaign already or a recording breaks a rule.
    provenance: where the recordings come from; campaign.json holds it, and readers ignore it.
    """
    folder = Path(folder)
    written = check_campaign(campaign, folder)
    for recording, columns in written:
        write_text(folder / f"{recording.name}.csv", _csv(columns))
    content = manifest_content(campaign)
    write_json(folder / FILE_NAME, {**content, "provenance": provenance} if provenance else content)


def check_campaign(campaign: Campaign, folder: Path) -> list[tuple[Recording, dict[str, NDArray]]]:
    """Recordings with their columns, each (samples,), as `write_campaign` would write them.

    Nothing is written. Raises CampaignError if the folder holds a campaign already or a rule is broken.
    """
    check_vacant(folder)
    rules = campaign.rules
    content = manifest_content(campaign)
    check_manifest(folder, content)
    written = [(recording, _columns(recording)) for recording in campaign.recordings]
    for recording, columns in written:
        _check_writable(folder / f"{recording.name}.csv", recording, columns)
    steps = column_steps([columns for _, columns in written], rules)
    for recording, columns in written:
        path, ambient = str(folder / f"{recording.name}.csv"), campaign.pressure / BAR
        check_recording(
            path, columns, role=recording.role, ambient_bar=ambient, steps=steps, rules=rules
        )
    check_reference(str(folder), campaign.recordings, campaign.pressure, rules)
    return written


def _read_file(path: Path) -> tuple[str, dict[str, NDArray]]:
    """SHA-256 of a file, and its columns by name, each (samples,) in the unit of the name."""
    try:
        content = read_bytes(path)
    except OSError as error:
        raise CampaignError(
            f"{path} cannot be read ({error.strerror}): add the file, or take it out of {FILE_NAME}"
        ) from None
    return hashlib.sha256(content).hexdigest(), read_columns(str(path), content)


def _recording(
    path: Path,
    sha256: str,
    columns: Mapping[str, NDArray],
    role: str,
    ambient: float,
    steps: Mapping[str, float],
    rules: RecordingRules,
) -> Recording:
    """Check and convert a file's columns; steps: coarse ones by column [bar]."""
    period = check_recording(
        str(path), columns, role=role, ambient_bar=ambient / BAR, steps=steps, rules=rules
    )
    signals = {channel.name: _signal(channel, columns) for channel in MEASURED_CHANNELS}
    return Recording(
        name=path.stem,
        role=role,
        period=period,
        sigma_S=columns.get(CONSUMPTION_COLUMN, np.zeros_like(columns["U_V"])),
        sha256=sha256,
        **signals,
    )


def _signal(channel: MeasuredChannel, columns: Mapping[str, NDArray]) -> NDArray:
    """One channel's signal (samples,) [SI]: the mean of its columns in the file."""
    return np.mean([columns[n] for n in channel.columns if n in columns], axis=0) * channel.scale


def _columns(recording: Recording) -> dict[str, NDArray]:
    """A recording's columns as they are written: units of the file, rounded."""
    columns = {TIME_COLUMN: recording.time}
    for name in CHANNELS:
        columns[CHANNEL[name].columns[0]] = recording.channel(name) / CHANNEL[name].scale
    if np.any(recording.sigma_S):
        columns[CONSUMPTION_COLUMN] = recording.sigma_S
    return {name: np.round(values, DECIMALS[name]) for name, values in columns.items()}


def _csv(columns: Mapping[str, NDArray]) -> str:
    template = ",".join(f"%.{DECIMALS[name]}f" for name in columns)
    rows = np.stack(list(columns.values()), axis=1)
    lines = [",".join(columns), *(template % tuple(row) for row in rows.tolist())]
    return "\n".join(lines) + "\n"


def _check_writable(path: Path, recording: Recording, columns: Mapping[str, NDArray]) -> None:
    if path.stem != recording.name:
        raise CampaignError(
            f"recording {recording.name!r} does not name a file: give it a name without folders"
        )
    for name, values in columns.items():
        if values.shape != (len(recording),) or not np.all(np.isfinite(values)):
            raise CampaignError(
                f"{path}: {name} has shape {values.shape} or a value that is not finite: give "
                f"{len(recording)} finite samples"
            )
