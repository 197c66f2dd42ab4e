"""Campaigns as files: campaign.json and one CSV per recording (docs/reference/files.md)."""

import hashlib
import os
from collections.abc import Iterable, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from epv_env.common.files import JSONFileError, read_bytes, read_json, write_json, write_text
from epv_env.common.units import BAR
from epv_env.plant.channels import CHANNEL, MEASURED_CHANNELS, MeasuredChannel
from epv_env.plant.parameters import ParameterError, checked_value
from identification.recordings.columns import CONSUMPTION_COLUMN, TIME_COLUMN, read_columns
from identification.recordings.noise import column_steps
from identification.recordings.recording import CHANNELS, ROLES, Campaign, CampaignError, Recording
from identification.recordings.recording_checks import check_recording
from identification.recordings.rules import RULES, RecordingRules

FORMAT = "epv-campaign/1"
"""Version of campaign.json, in its field `format`."""

FILE_NAME = "campaign.json"
"""Name of the file in the campaign's folder."""

DECIMALS = {
    TIME_COLUMN: 9,
    **{channel.columns[0]: channel.decimals for channel in MEASURED_CHANNELS},
    CONSUMPTION_COLUMN: 9,
}
"""Decimals written: a hundredth of an ADC step or less, and any rate's times as uniform."""


class Environment(msgspec.Struct):
    """Field `environment` of campaigns and logs."""

    temperature_K: float
    pressure_bar: float


class _Entry(msgspec.Struct):
    file: str
    role: str


class _Manifest(msgspec.Struct):
    """What a campaign.json holds; other fields are ignored."""

    format: str
    name: str
    environment: Environment
    recordings: list[_Entry]


def read_campaign(folder: str | PathLike[str], rules: RecordingRules = RULES) -> Campaign:
    """The campaign in a folder, every rule of docs/reference/files.md checked. Raises CampaignError."""
    folder = Path(folder)
    remedy = "give the folder of a campaign, or write the file as docs/reference/files.md shows"
    try:
        manifest = read_json(folder / FILE_NAME, _Manifest, version=FORMAT, remedy=remedy)
    except JSONFileError as error:
        raise CampaignError(str(error)) from None
    temperature, pressure = ambient(folder / FILE_NAME, manifest.environment)
    roles = _roles(folder, manifest)
    files = {path: _read_file(path) for path in roles}
    steps = column_steps([columns for _, columns in files.values()], rules)
    recordings = []
    for path, role in roles.items():
        sha256, columns = files[path]
        period = check_recording(str(path), columns, role, pressure / BAR, steps, rules)
        recordings.append(_recording(path.stem, sha256, columns, role, period))
    return Campaign(
        name=manifest.name,
        temperature=temperature,
        pressure=pressure,
        recordings=tuple(recordings),
        folder=folder,
        rules=rules,
    )


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
    for recording, columns in check_campaign(campaign, folder):
        write_text(folder / f"{recording.name}.csv", _csv(columns))
    content = msgspec.to_builtins(_manifest(campaign))
    write_json(folder / FILE_NAME, {**content, "provenance": provenance} if provenance else content)


def check_campaign(campaign: Campaign, folder: Path) -> list[tuple[Recording, dict[str, NDArray]]]:
    """Recordings with their columns, each (samples,), as `write_campaign` would write them.

    Nothing is written. Raises CampaignError if the folder holds a campaign already or a rule is broken.
    """
    check_vacant(folder)
    manifest = _manifest(campaign)
    ambient(folder / FILE_NAME, manifest.environment)
    _roles(folder, manifest)
    written = [(recording, _columns(recording)) for recording in campaign.recordings]
    for recording, columns in written:
        _check_writable(folder / f"{recording.name}.csv", recording, columns)
    steps = column_steps([columns for _, columns in written], campaign.rules)
    for recording, columns in written:
        path = str(folder / f"{recording.name}.csv")
        check_recording(path, columns, recording.role, campaign.pressure / BAR, steps, campaign.rules)
    return written


def _manifest(campaign: Campaign) -> _Manifest:
    return _Manifest(
        format=FORMAT,
        name=campaign.name,
        environment=Environment(float(campaign.temperature), float(campaign.pressure / BAR)),
        recordings=[
            _Entry(f"{recording.name}.csv", recording.role) for recording in campaign.recordings
        ],
    )


def ambient(path: Path, environment: Environment) -> tuple[float, float]:
    """Temperature [K] and pressure [Pa] in a file, inside the domains of the plant's parameters.

    Raises CampaignError.
    """
    values = []
    for name, symbol, unit in (("temperature_K", "T_env", 1.0), ("pressure_bar", "p_env", BAR)):
        value = getattr(environment, name)
        try:
            values.append(checked_value(symbol, round(value * unit, 6)))  # 1.1 * 1e5 is above 110000
        except ParameterError as error:
            raise CampaignError(f"{path}, environment: {name} is {value!r}: {error}") from None
    return values[0], values[1]


def _roles(folder: Path, manifest: _Manifest) -> dict[Path, str]:
    """Each recording's role by the path of its file, which lies in the campaign's folder."""
    if not manifest.recordings:
        raise CampaignError(
            f"{folder / FILE_NAME}: recordings is empty: name at least one file and its role"
        )
    roles: dict[Path, str] = {}
    for number, entry in enumerate(manifest.recordings, start=1):
        place = f"{folder / FILE_NAME}, recording {number}"
        path = _inside(place, folder, entry.file)
        if entry.role not in ROLES:
            raise CampaignError(
                f"{place}: unknown role {entry.role!r}: choose one of {', '.join(ROLES)}"
            )
        _check_new(place, path, roles)
        roles[path] = entry.role
    return roles


def _inside(place: str, folder: Path, name: str) -> Path:
    """The path of a file that lies in the folder, however it is written or linked."""
    try:
        path = folder / name
        if path.resolve().is_relative_to(folder.resolve()):
            return path
    except (OSError, ValueError, RuntimeError):  # a path the system cannot hold, a loop of links
        pass
    raise CampaignError(
        f"{place}: file {name!r} leaves the campaign's folder: copy it there and give its name"
    )


def _check_new(place: str, path: Path, earlier: Iterable[Path]) -> None:
    """Files, and the names of recordings that come from them, occur once."""
    for other in earlier:
        if path.resolve() == other.resolve() or path.stem == other.stem:
            raise CampaignError(
                f"{place}: {path.name} is named twice, after {other.name}: name each file once, and "
                "rename files that differ in folder or suffix only"
            )


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
    name: str, sha256: str, columns: Mapping[str, NDArray], role: str, period: float
) -> Recording:
    return Recording(
        name=name,
        role=role,
        period=period,
        sigma_S=columns.get(CONSUMPTION_COLUMN, np.zeros_like(columns["U_V"])),
        sha256=sha256,
        **{channel.name: _signal(channel, columns) for channel in MEASURED_CHANNELS},
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
