"""The formats that can be imported, by the end of a file's name."""

import hashlib
from pathlib import Path

from identification.importing.formats.matlab import MATLAB
from identification.importing.formats.mdf import MDF
from identification.importing.formats.parquet import PARQUET
from identification.importing.formats.source_file import ImportingError, SourceFile
from identification.importing.formats.tdms import TDMS
from identification.importing.formats.text_table import TEXT

FORMATS = (MDF, MATLAB, TDMS, PARQUET, TEXT)
"""Every format; the command reads no other."""


def read_source(path: Path) -> SourceFile:
    """The channels of a measurement file. Raises ImportingError."""
    known = {suffix: form for form in FORMATS for suffix in form.suffixes}
    form = known.get(path.suffix.lower())
    if form is None:
        raise ImportingError(
            f"{path}: unknown kind of file {path.suffix!r}: give one of {', '.join(sorted(known))}"
        )
    if not path.is_file():
        state = "is no regular file" if path.exists() else "does not exist"
        raise ImportingError(f"{path} {state}: give the path of a measurement file")
    try:
        with path.open("rb") as stream:
            sha256 = hashlib.file_digest(stream, "sha256").hexdigest()
        version, channels = form.read(path)
    except ImportingError:
        raise
    except OSError as error:
        reason = error.strerror or str(error).splitlines()[0][:160]
        raise ImportingError(f"{path} cannot be read ({reason}): export it anew") from None
    except Exception as error:  # the formats' packages raise whatever they like on damaged files
        reason = (str(error).splitlines() or [type(error).__name__])[0][:160]
        raise ImportingError(
            f"{path} is damaged or no {form.name} file ({reason}): export it anew"
        ) from None
    if not channels:
        raise ImportingError(f"{path}: no series of numbers in it: export the channels as numbers")
    return SourceFile(path=path, format=version, sha256=sha256, channels=tuple(channels))
