"""Campaigns as files: campaign.json and one CSV per recording (docs/reference/files.md)."""

import hashlib
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.common.files import JSONFileError, decoded, read_bytes, write_json, write_text
from epv_env.common.units import BAR
from epv_env.plant.channels import CHANNEL, MEASURED_CHANNELS, MeasuredChannel
from epv_env.plant.parameters import ParameterError, checked_value
from identification.recordings.columns import CONSUMPTION_COLUMN, TIME_COLUMN, read_columns
from identification.recordings.noise import column_steps
from identification.recordings.recording import CHANNELS, ROLES, Campaign, CampaignError, Recording
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


FORMAT = "epv-campaign/1"
"""Version of the file, in its field `format`."""

FILE_NAME = "campaign.json"
"""Name of the file in the campaign's folder."""


@dataclass(frozen=True, kw_only=True)
class Manifest:
    """Content of a campaign.json, checked."""

    name: str
    """Of the campaign."""
    temperature: float
    """T_env [K]."""
    pressure: float
    """p_env [Pa absolute]."""
    roles: dict[Path, str]
    """Each recording's role by the path of its file, which lies in the campaign's folder."""


def read_manifest(folder: Path) -> Manifest:
    """The campaign.json of a folder. Raises CampaignError."""
    path = folder / FILE_NAME
    remedy = "give the folder of a campaign, or write the file anew"
    try:
        content = decoded(path, remedy=remedy, allow_nan=True)  # `checked_value` names the field
    except JSONFileError as error:
        raise CampaignError(str(error)) from None
    return check_manifest(folder, content)


def manifest_content(campaign: Campaign) -> dict[str, Any]:
    """What a campaign's campaign.json holds, for json.dumps."""
    return {
        "format": FORMAT,
        "name": campaign.name,
        "environment": {
            "temperature_K": float(campaign.temperature),
            "pressure_bar": float(campaign.pressure / BAR),
        },
        "recordings": [
            {"file": f"{recording.name}.csv", "role": recording.role}
            for recording in campaign.recordings
        ],
    }


def check_manifest(folder: Path, content: Any) -> Manifest:
    """The meaning of a campaign.json's content. Raises CampaignError; fields not listed are ignored."""
    file = str(folder / FILE_NAME)
    version = content.get("format") if isinstance(content, dict) else None
    if version != FORMAT:
        raise CampaignError(
            f"{file} has format {version!r}, this version reads {FORMAT!r}: write it anew"
        )
    environment = _field(file, content, "environment", dict)
    return Manifest(
        name=_field(file, content, "name", str),
        temperature=_ambient(f"{file}, environment", environment, "temperature_K", "T_env", 1.0),
        pressure=_ambient(f"{file}, environment", environment, "pressure_bar", "p_env", BAR),
        roles=_roles(file, folder, _field(file, content, "recordings", list)),
    )


def _roles(file: str, folder: Path, entries: Sequence[Any]) -> dict[Path, str]:
    if not entries:
        raise CampaignError(f"{file}: recordings is empty: name at least one file and its role")
    roles: dict[Path, str] = {}
    for number, entry in enumerate(entries, start=1):
        place = f"{file}, recording {number}"
        path = _inside(place, folder, _field(place, entry, "file", str))
        role = _field(place, entry, "role", str)
        if role not in ROLES:
            raise CampaignError(f"{place}: unknown role {role!r}: choose one of {', '.join(ROLES)}")
        _check_new(place, path, roles)
        roles[path] = role
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


def _field(place: str, content: Any, name: str, *kinds: type) -> Any:
    """A field of a JSON object, if it is there and of one of the kinds."""
    value = content.get(name) if isinstance(content, dict) else None
    if type(value) not in kinds:
        expected = {str: "text", dict: "an object", list: "a list", float: "a number"}[kinds[-1]]
        raise CampaignError(
            f"{place}: {name} is missing or not {expected}: give it as in docs/reference/files.md"
        )
    return value


def _ambient(place: str, environment: Any, name: str, symbol: str, unit: float) -> float:
    """A value [SI] given in a unit, inside the domain of the plant's parameter of that symbol."""
    value = _field(place, environment, name, int, float)
    try:
        return checked_value(symbol, round(value * unit, 6))  # 1.1 * 1e5 is a little above 110000
    except (ParameterError, OverflowError) as error:
        raise CampaignError(f"{place}: {name} is {value!r}: {error}") from None
