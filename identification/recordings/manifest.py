"""The campaign.json of a campaign: ambient conditions, and the role of each recording's file."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from epv_env.common.json_files import JSONFileError, decoded
from epv_env.common.units import BAR
from epv_env.plant.parameters import ParameterError, checked_value
from identification.recordings.recording import ROLES, Campaign, CampaignError

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
