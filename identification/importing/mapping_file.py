"""What names of channels mean, and the mapping file, which says what names do not."""

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import msgspec

from epv_env.common.files import read_json
from identification.importing.source_file import (
    LONGEST_NAME,
    ImportingError,
    SourceChannel,
    SourceFile,
)
from identification.importing.units import parsed_unit
from identification.recordings.recording import ROLES, UNITS

QUANTITY: Mapping[str, str] = {
    "time": "time",
    **{n: {"A": "current", "V": "voltage"}.get(unit, "pressure") for n, (unit, _) in UNITS.items()},
}
"""What an import looks for, with its quantity."""

NAMES: Mapping[str, str] = {
    "time": r"t|time|timestamps?|timechannel|(abs|mess)?zeit|xvalue",
    "I": r"i|(coil|solenoid)?current|currentcoil|(magnet|spulen|i)?strom|i(coil|mv|magnet|solenoid)",
    "U": r"[uv]|(coil|solenoid)?voltage|voltagecoil|(magnet|spulen)?spannung|[uv]coil"
    r"|u(mv|magnet|solenoid)",
    "p1": r"p(1|in|input|supply|vorrat|reservoir)|(supply|reservoir|input|inputchamber)pressure"
    r"|(eingangs|vorrats)druck|druck(1|eingang)|pressure(1|supply)",
    "p2": r"p(2|out|output|circuit|kreis)|(circuit|output|outputchamber)pressure"
    r"|(ausgangs|kreis|brems)druck|druck(2|ausgang)|pressure(2|circuit)",
    "p3": r"p(3|control|ctrl|st|steuer)|(control|controlchamber)pressure|steuer(kammer)?druck"
    r"|druck(3|steuer)|pressure(3|control)",
}
"""Names in lower case, without anything but letters and digits; English and German. A channel of the
bench that is not listed has its own name."""

INSIDE = r"(?:[^\[\](){}]|\([^()]{0,20}\)|\[[^\[\]]{0,20}\]){1,30}?"
BRACKETED = re.compile(rf"^(.*?)\s*(?:[\[({{]({INSIDE})[\])}}]|\s(?:in|/)\s(\S+(?:\s\S+)?)|/(\S+))\s*$")
"""A name with its unit, of bounded length: "p1 [bar]", "p1 [bar[g]]", "p1 in bar rel.", "p1/bar"."""


def split_name(name: str) -> tuple[str, str]:
    """A channel's name without its unit, and the unit in it, empty if there is none."""
    if len(name) > LONGEST_NAME:
        return name, ""
    for place in (i for i, sign in enumerate(name) if sign == "_"):
        unit = parsed_unit(name[place + 1 :].replace("_per_", "/").replace("_", " "))
        if place and unit is not None and unit.quantity in QUANTITY.values():
            return name[:place], unit.text
    found = BRACKETED.match(name)
    if found:
        inside = next(part for part in found.groups()[1:] if part).strip()
        if parsed_unit(inside) is not None:
            return found[1], inside
    return name, ""


def meaning(name: str, unit: str = "") -> str | None:
    """The channel of a recording that a channel's name and unit mean; None if they mean none."""
    bare, inside = split_name(name.split("\\")[0])
    plain = re.sub(r"[^a-z0-9]", "", bare.rpartition(".")[2].lower())
    parsed = parsed_unit(unit or inside)
    for wanted, quantity in QUANTITY.items():
        known = re.fullmatch(NAMES.get(wanted, wanted.lower()), plain)
        if known and (parsed is None or parsed.quantity == quantity):
            return wanted
    return None


def proposed(channels: Sequence[SourceChannel]) -> dict[str, list[SourceChannel]]:
    """The channels of a file that names and units propose, by what they mean; several: ambiguous."""
    found: dict[str, list[SourceChannel]] = {}
    for channel in channels:
        usable = channel.known.size or channel.fault
        name = meaning(channel.name, channel.unit) if usable else None
        if name is not None:
            found.setdefault(name, []).append(channel)
    return found


def named_channel(source: SourceFile, wanted: str) -> SourceChannel:
    """The one channel that a mapping file calls by this name. Raises ImportingError."""
    found = [c for c in source.channels if wanted in (c.name, c.full_name)]
    found = found or [
        c for c in source.channels if wanted in (split_name(c.name)[0], split_name(c.full_name)[0])
    ]
    found = [channel for channel in found if channel.known.size or channel.fault] or found
    if len(found) != 1:
        count = "no channel" if not found else f"{len(found)} channels"
        known = ", ".join(source.label(channel) for channel in source.channels[:20])
        raise ImportingError(
            f"{source.path}: {count} of the name {wanted!r}; there are {known}: mend the mapping file"
        )
    return found[0]


FORMAT = "epv-mapping/1"
"""Version of the file, in its field `format`."""


class ChannelEntry(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """Which channel of the files is one of the recording's, and how it reads."""

    source: str | None = None
    """Name of the channel in the files, after its table and a slash where several have it; None: as
    names propose."""
    unit: str | None = None
    """Unit, with gauge or absolute for pressures; None: as the file says."""
    factor: float = 1.0
    """Right value over reading, besides the unit; -1 turns a sign round."""
    time: str | None = None
    """Name of the channel that holds its times; None: as the file says, or the one named as "time"."""


class RecordingEntry(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """What becomes of one measurement file."""

    role: Annotated[str, msgspec.Meta(pattern=f"^({'|'.join(ROLES)})$")] | None = None
    """One of ROLES; None: proposed from its name and voltage."""
    name: str | None = None
    """Of the recording; None: that of the file without its suffix."""
    join: tuple[str, ...] = ()
    """Names of files that hold further channels of the same recording, at times from the same begin."""


class Environment(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """The ambient conditions of the campaign."""

    temperature_K: float | None = None
    pressure_bar: float | None = None


ChannelName = Annotated[str, msgspec.Meta(pattern=f"^({'|'.join(QUANTITY)})$")]


class MappingFile(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """A mapping file; what it leaves out is proposed."""

    format: str = FORMAT
    environment: Environment = msgspec.field(default_factory=Environment)
    channels: dict[ChannelName, ChannelEntry] = msgspec.field(default_factory=dict)
    """By channel of the recording (QUANTITY)."""
    recordings: dict[str, RecordingEntry] = msgspec.field(default_factory=dict)
    """By the measurement file's name without its folder."""
    gauge: bool = False
    """Whether pressures are gauge where no unit says gauge or absolute."""
    missing: tuple[str, ...] = ()
    """What stands for a missing reading, as a cell or a number: "-9999"."""

    def entry(self, name: str) -> ChannelEntry:
        """What the file says of a channel of the recording."""
        return self.channels.get(name, ChannelEntry())

    def recording(self, path: Path) -> RecordingEntry:
        """What the file says of a measurement file."""
        return self.recordings.get(path.name, RecordingEntry())


def mapping_example(sources: Mapping[str, str], units: Mapping[str, str]) -> str:
    """The text of a mapping file: names in the files, and units, of channels of a recording."""
    channels = {
        n: {"source": s} | ({"unit": units[n]} if n in units else {}) for n, s in sources.items()
    }
    return json.dumps({"format": FORMAT, "channels": channels}, ensure_ascii=False)


def read_mapping(path: Path) -> MappingFile:
    """A mapping file. Raises JSONFileError."""
    remedy = "write it as docs/how-to/use-your-recordings.md shows"
    return read_json(path, MappingFile, version=FORMAT, remedy=remedy)
