"""Campaigns as files: campaign.json and one CSV per recording (docs/reference/files.md)."""

import hashlib
import os
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from epv_env.common.files import JSONFileError, read_bytes, read_json, write_json, write_text
from epv_env.common.units import BAR
from epv_env.plant.channels import CHANNEL, MEASURED_CHANNELS
from epv_env.plant.parameters import ParameterError, checked_value
from identification.recordings.columns import (
    CHANNEL_OF,
    CONSUMPTION_COLUMN,
    REQUIRED_COLUMNS,
    SUPPLY_COLUMNS,
    TIME_COLUMN,
    Place,
    read_columns,
)
from identification.recordings.noise import column_steps
from identification.recordings.recording import (
    CHANNELS,
    ROLES,
    RULES,
    Campaign,
    CampaignError,
    Recording,
    RecordingRules,
)
from identification.recordings.recording_checks import check_recording

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
    """Ambient conditions in a manifest."""

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
    manifest = read_manifest(folder / FILE_NAME, _Manifest, FORMAT, remedy)
    temperature, pressure = checked_ambient(folder / FILE_NAME, manifest.environment)
    roles = _roles(folder, manifest)
    contents = {path: content_of(path) for path in roles}
    files = {path: _columns_of(str(path), content) for path, content in contents.items()}
    steps = column_steps(list(files.values()), rules)
    recordings = []
    for path, role in roles.items():
        sha256, columns = hashlib.sha256(contents[path]).hexdigest(), files[path]
        period = check_recording(Place(file=str(path)), columns, role, pressure / BAR, steps, rules)
        signals = {
            c.name: np.mean([columns[n] for n in c.columns if n in columns], axis=0) * c.scale
            for c in MEASURED_CHANNELS
        }
        flow = columns.get(CONSUMPTION_COLUMN, np.zeros_like(columns["U_V"]))
        recordings.append(
            Recording(name=path.stem, role=role, period=period, sigma_S=flow, sha256=sha256, **signals)
        )
    return Campaign(
        name=manifest.name,
        temperature=temperature,
        pressure=pressure,
        recordings=tuple(recordings),
        folder=folder,
        rules=rules,
    )


Manifest = TypeVar("Manifest")


def read_manifest(path: Path, shape: type[Manifest], version: str, remedy: str) -> Manifest:
    """The JSON file of a folder. Raises CampaignError."""
    try:
        return read_json(path, shape, version=version, remedy=remedy)
    except JSONFileError as error:
        raise CampaignError(str(error)) from None


def content_of(path: Path) -> bytes:
    """The bytes of a file that a folder's JSON names. Raises CampaignError."""
    try:
        return read_bytes(path)
    except OSError as error:
        raise CampaignError(
            f"{path} cannot be read ({error.strerror}): add the file, or take it out of the JSON file"
        ) from None


def _columns_of(file: str, content: bytes) -> dict[str, NDArray]:
    """A recording's columns by name, each (samples,) in the unit of the name. Raises CampaignError."""
    columns = read_columns(file, content, REQUIRED_COLUMNS, (*CHANNEL_OF, CONSUMPTION_COLUMN))
    supply = tuple(name for way in SUPPLY_COLUMNS for name in way if name in columns)
    if supply not in SUPPLY_COLUMNS:
        raise CampaignError(
            f"{file}, line 1: p1 is given by {' and '.join(supply) or 'no column'}: give p1_bar, or "
            "both p1a_bar and p1b_bar, not a mixture"
        )
    return columns


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
    places: Mapping[str, Place] = {},
) -> None:
    """Write a campaign that `read_campaign` takes; its JSON last, so that a part of one is none.

    Each file is written whole or not at all, in place of one of the same name. Raises CampaignError,
    before anything is written, if the folder holds a campaign already or a recording breaks a rule.
    provenance: where the recordings come from; campaign.json holds it, and readers ignore it.
    places: what messages call recordings, by name; the file that is written where one is left out.
    """
    folder = Path(folder)
    for recording, columns in check_campaign(campaign, folder, places):
        template = ",".join(f"%.{DECIMALS[name]}f" for name in columns)
        rows = np.stack(list(columns.values()), axis=1).tolist()
        lines = [",".join(columns), *(template % tuple(row) for row in rows)]
        write_text(folder / f"{recording.name}.csv", "\n".join(lines) + "\n")
    content = msgspec.to_builtins(_manifest(campaign))
    write_json(folder / FILE_NAME, {**content, "provenance": provenance} if provenance else content)


def check_campaign(
    campaign: Campaign, folder: Path, places: Mapping[str, Place] = {}
) -> list[tuple[Recording, dict[str, NDArray]]]:
    """Recordings with their columns, each (samples,), as `write_campaign` would write them.

    Nothing is written. Raises CampaignError if the folder holds a campaign already or a rule is broken.
    """
    check_vacant(folder)
    manifest = _manifest(campaign)
    checked_ambient(folder / FILE_NAME, manifest.environment)
    _roles(folder, manifest)
    written = [(recording, _columns(recording)) for recording in campaign.recordings]
    for recording, columns in written:
        if (folder / f"{recording.name}.csv").stem != recording.name:
            raise CampaignError(
                f"recording {recording.name!r} does not name a file: give it a name without folders"
            )
        for name, values in columns.items():
            if values.shape != (len(recording),) or not np.all(np.isfinite(values)):
                raise CampaignError(
                    f"{folder / recording.name}.csv: {name} has shape {values.shape} or a value that is "
                    f"not finite: give {len(recording)} finite samples"
                )
    steps = column_steps([columns for _, columns in written], campaign.rules)
    for recording, columns in written:
        written_file = Place(file=str(folder / f"{recording.name}.csv"))
        place = places.get(recording.name, written_file)
        check_recording(place, columns, recording.role, campaign.pressure / BAR, steps, campaign.rules)
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


def checked_ambient(file: Path, environment: Environment) -> tuple[float, float]:
    """Temperature [K] and pressure [Pa], inside the domains of the plant's parameters.

    file: begins the message of the CampaignError for values outside.
    """
    values = []
    for name, symbol, unit in (("temperature_K", "T_env", 1.0), ("pressure_bar", "p_env", BAR)):
        value = getattr(environment, name)
        try:
            values.append(checked_value(symbol, round(value * unit, 6)))  # 1.1 * 1e5 is above 110000
        except ParameterError as error:
            place = f"{file}, environment"
            raise CampaignError(f"{place}: {name} is {value!r}: {error}") from None
    return values[0], values[1]


def _roles(folder: Path, manifest: _Manifest) -> dict[Path, str]:
    """Each recording's role by the path of its file, which lies in the campaign's folder."""
    file = folder / FILE_NAME
    paths = named_files(file, "recordings", [entry.file for entry in manifest.recordings])
    for number, entry in enumerate(manifest.recordings, start=1):
        if entry.role not in ROLES:
            raise CampaignError(
                f"{file}, recording {number}: unknown role {entry.role!r}: choose one of "
                f"{', '.join(ROLES)}"
            )
    return dict(zip(paths, (entry.role for entry in manifest.recordings), strict=True))


def named_files(manifest: Path, field: str, names: Sequence[str]) -> list[Path]:
    """Paths of the files that a folder's JSON names: some, each once, all of them in the folder.

    Names of recordings come from names of files, which therefore differ without folder and suffix, too.
    manifest: the JSON file. field: of its list. Raises CampaignError.
    """
    folder, paths = manifest.parent, list[Path]()
    if not names:
        raise CampaignError(f"{manifest}: {field} is empty: name at least one file")
    for number, name in enumerate(names, start=1):
        place, path = f"{manifest}, {field.removesuffix('s')} {number}", folder / name
        try:
            inside = path.resolve().is_relative_to(folder.resolve())
        except (OSError, ValueError, RuntimeError):  # a path the system cannot hold, a loop of links
            inside = False
        if not inside:
            raise CampaignError(
                f"{place}: file {name!r} leaves the folder: copy it there and give its name"
            )
        for other in paths:
            if path.resolve() == other.resolve() or path.stem == other.stem:
                raise CampaignError(
                    f"{place}: {path.name} is named twice, after {other.name}: name each file once, and "
                    "rename files that differ in folder or suffix only"
                )
        paths.append(path)
    return paths


def _columns(recording: Recording) -> dict[str, NDArray]:
    """A recording's columns as they are written: units of the file, rounded."""
    columns = {TIME_COLUMN: recording.time}
    for name in CHANNELS:
        columns[CHANNEL[name].columns[0]] = recording.channel(name) / CHANNEL[name].scale
    if np.any(recording.sigma_S):
        columns[CONSUMPTION_COLUMN] = recording.sigma_S
    return {name: np.round(values, DECIMALS[name]) for name, values in columns.items()}
