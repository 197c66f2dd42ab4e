"""What an import found, as tables for people."""

from collections.abc import Sequence

import numpy as np

from identification.importing.channel_names import meaning
from identification.importing.formats.source_file import SourceChannel, SourceFile
from identification.importing.import_campaign import ImportedCampaign, ImportedFile
from identification.importing.resampling import usual_rate


def source_table(source: SourceFile) -> str:
    """The channels of a file: name, unit, range, rate, and what its name means."""
    rows = [_source_row(channel) for channel in source.channels]
    title = f"{source.path} ({source.format})"
    return f"{title}\n{_aligned(('channel', 'unit', 'range', 'rate', 'proposed'), rows)}"


def import_text(imported: ImportedCampaign) -> str:
    """What every file becomes, and what was assumed."""
    parts = [_file_text(file) for file in imported.files]
    parts += [f"assumed: {sentence}" for sentence in imported.assumptions]
    return "\n\n".join(parts[: len(imported.files)]) + "\n\n" + "\n".join(parts[len(imported.files) :])


def _file_text(file: ImportedFile) -> str:
    rows = [
        (
            channel.name,
            channel.source.name,
            f"{channel.unit.text} {channel.reference}".strip(),
            channel.conversion,
            f"{usual_rate(channel.time):.6g} Hz",
            "resampled" if channel.name in file.gridded.resampled else "as recorded",
        )
        for channel in file.channels
    ]
    recording = file.recording
    title = (
        f"{file.source.path.name} -> {recording.name}.csv, role {recording.role}, "
        f"{len(recording)} samples at {1 / recording.period:.6g} Hz"
    )
    heads = ("becomes", "channel", "unit", "to SI", "rate", "samples")
    return f"{title}\n{_aligned(heads, rows)}"


def _source_row(channel: SourceChannel) -> tuple[str, ...]:
    values = channel.values[np.isfinite(channel.values)]
    span = f"{np.min(values):.5g} to {np.max(values):.5g}" if len(values) else "empty"
    timed = channel.time is not None and len(channel.time) > 1 and np.ptp(channel.time) > 0
    rate = f"{usual_rate(channel.time):.6g} Hz" if timed and channel.time is not None else ""
    return channel.name, channel.unit, span, rate, meaning(channel) or ""


def _aligned(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Columns as wide as their widest cell."""
    lines = [heads, *rows]
    widths = [max(len(line[column]) for line in lines) for column in range(len(heads))]
    return "\n".join(
        "  " + "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    )
