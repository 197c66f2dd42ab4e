"""What names of channels mean, and the mapping file, which says what names do not."""

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from epv_env.common.files import read_json
from identification.importing.source_file import ImportingError, SourceChannel, SourceFile
from identification.importing.units import EXAMPLES, parsed_unit
from identification.recordings.recording import CHANNELS, ROLES, UNITS

QUANTITY_OF_UNIT = {"A": "current", "V": "voltage", "bar": "pressure"}

QUANTITY: Mapping[str, str] = {
    "time": "time",
    **{name: QUANTITY_OF_UNIT[unit] for name, (unit, _) in UNITS.items()},
    "p1a": "pressure",
    "p1b": "pressure",
    "sigma_S": "mass flow",
}
"""What an import looks for, with its quantity. p1a and p1b, two sensors, may stand for p1."""

NAMES: Mapping[str, tuple[str, ...]] = {name: (name.lower(),) for name in CHANNELS} | {
    "time": ("time", "t", "zeit", "timestamp", "timestamps", "timechannel", "abszeit", "messzeit",
             "xvalue"),
    "I": ("i", "current", "strom", "icoil", "imv", "coilcurrent", "solenoidcurrent", "magnetstrom",
          "spulenstrom", "istrom", "currentcoil", "imagnet", "isolenoid"),
    "U": ("u", "v", "voltage", "spannung", "ucoil", "umv", "vcoil", "coilvoltage", "solenoidvoltage",
          "magnetspannung", "spulenspannung", "voltagecoil", "umagnet", "usolenoid"),
    "p1": ("p1", "pin", "pinput", "inputpressure", "supplypressure", "psupply", "eingangsdruck",
           "vorratsdruck", "pvorrat", "reservoirpressure", "preservoir", "druck1", "pressure1",
           "druckeingang", "inputchamberpressure", "pressuresupply"),
    "p1a": ("p1a", "p11", "reservoir1", "pressure1a", "druck1a"),
    "p1b": ("p1b", "p12", "reservoir2", "pressure1b", "druck1b"),
    "p2": ("p2", "pout", "poutput", "outputpressure", "circuitpressure", "pcircuit", "ausgangsdruck",
           "kreisdruck", "bremsdruck", "pkreis", "druck2", "pressure2", "druckausgang",
           "outputchamberpressure", "pressurecircuit"),
    "p3": ("p3", "pcontrol", "controlpressure", "pctrl", "steuerdruck", "pst", "psteuer", "druck3",
           "pressure3", "drucksteuer", "controlchamberpressure", "pressurecontrol", "steuerkammerdruck"),
    "sigma_S": ("sigmas", "consumption", "verbrauch", "massflow", "massenstrom", "consumedair",
                "luftverbrauch"),
}  # fmt: skip
"""Names in lower case, without anything but letters and digits; English and German. A channel of the
bench that is not listed has its own name."""

INSIDE = r"(?:[^\[\](){}]|\([^()]{0,20}\)|\[[^\[\]]{0,20}\]){1,30}?"
BRACKETED = re.compile(rf"^(.*?)\s*(?:[\[({{]({INSIDE})[\])}}]|\s(?:in|/)\s(\S+(?:\s\S+)?)|/(\S+))\s*$")
"""A name with its unit, of bounded length: "p1 [bar]", "p1 [bar[g]]", "p1 in bar rel.", "p1/bar"."""


def split_name(name: str) -> tuple[str, str]:
    """A channel's name without its unit, and the unit in it, empty if there is none."""
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
    for wanted, known in NAMES.items():
        if plain in known and (parsed is None or parsed.quantity == QUANTITY[wanted]):
            return wanted
    return None


def proposed(channels: Sequence[SourceChannel]) -> dict[str, list[SourceChannel]]:
    """The channels of a file that names and units propose, by what they mean; several: ambiguous."""
    found: dict[str, list[SourceChannel]] = {}
    for channel in channels:
        name = meaning(channel.name, channel.unit) if channel.known.size else None
        if name is not None:
            found.setdefault(name, []).append(channel)
    return found


def named_channel(source: SourceFile, wanted: str) -> SourceChannel:
    """The one channel that a mapping file calls by this name. Raises ImportingError."""
    found = [c for c in source.channels if wanted in (c.name, c.full_name)]
    found = found or [c for c in source.channels if split_name(c.name)[0] == wanted]
    found = [channel for channel in found if channel.known.size] or found
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

    role: str | None = None
    """One of ROLES; None: proposed from its name and voltage."""
    name: str | None = None
    """Of the recording; None: that of the file without its suffix."""


class Environment(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """The ambient conditions of the campaign."""

    temperature_K: float | None = None
    pressure_bar: float | None = None


class MappingFile(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """A mapping file; what it leaves out is proposed."""

    format: str = FORMAT
    environment: Environment = msgspec.field(default_factory=Environment)
    channels: dict[str, ChannelEntry] = msgspec.field(default_factory=dict)
    """By channel of the recording (QUANTITY)."""
    recordings: dict[str, RecordingEntry] = msgspec.field(default_factory=dict)
    """By the measurement file's name without its folder."""
    gauge: bool = False
    """Whether pressures are gauge where no unit says gauge or absolute."""


def mapping_example(sources: Mapping[str, str], *, units: bool = True) -> str:
    """The text of a mapping file for channels of a recording by their names in the files."""
    channels = {
        n: {"source": s} | ({"unit": EXAMPLES[QUANTITY[n]]} if units else {}) for n, s in sources.items()
    }
    return json.dumps({"format": FORMAT, "channels": channels}, ensure_ascii=False)


def read_mapping(path: Path) -> MappingFile:
    """A mapping file. Raises ImportingError or JSONFileError."""
    remedy = "write it as docs/how-to/use-your-recordings.md shows"
    mapping = read_json(path, MappingFile, version=FORMAT, remedy=remedy)
    for name in mapping.channels:
        if name not in QUANTITY:
            raise ImportingError(
                f"{path}: channels has {name!r}, and a recording has {', '.join(QUANTITY)}: rename it"
            )
    for file, entry in mapping.recordings.items():
        if entry.role is not None and entry.role not in ROLES:
            raise ImportingError(
                f"{path}, recordings, {file}: unknown role {entry.role!r}: choose one of "
                f"{', '.join(ROLES)}"
            )
    return mapping
