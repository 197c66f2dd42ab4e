"""The mapping file: what the channels of the measurement files are, where names do not say it."""

from pathlib import Path

import msgspec

from epv_env.common.json_files import read_json
from identification.importing.channel_names import QUANTITY
from identification.importing.formats.source_file import ImportingError
from identification.recordings.recording import ROLES

FORMAT = "epv-mapping/1"
"""Version of the file, in its field `format`."""


class ChannelEntry(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """Which channel of the files is one of the recording's, and how it reads."""

    source: str
    """Name of the channel in the files."""
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
    """By channel of the recording (channel_names.QUANTITY)."""
    recordings: dict[str, RecordingEntry] = msgspec.field(default_factory=dict)
    """By the measurement file's name without its folder."""


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
