"""JSON files: written whole; read with one sentence for each way in which a file can be wrong."""

import json
import re
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from epv_env.common.files import write_text

Shape = TypeVar("Shape")


class JSONFileError(ValueError):
    """A JSON file cannot be used: the message names the file, the place, the rule and the remedy."""


def write_json(path: str | PathLike[str], content: Any, *, allow_nan: bool = True) -> None:
    """Write content as indented JSON, whole or not at all.

    Raises ValueError for a number that is not finite, unless `allow_nan`.
    """
    write_text(Path(path), json.dumps(content, indent=1, allow_nan=allow_nan) + "\n")


def read_json(path: str | PathLike[str], shape: type[Shape], *, version: str, remedy: str) -> Shape:
    """The content of a JSON file as an instance of `shape`, every field checked against its type.

    Args:
        path: the file; UTF-8, with or without a byte order mark.
        shape: a msgspec.Struct, dataclass or TypedDict. Fields that it does not name are ignored, unless
            it forbids them.
        version: what the file's field `format` has to say.
        remedy: what to do about a file that is not of this form, such as "write it anew with ...".

    Raises:
        JSONFileError: the file is missing, no regular file, not JSON, of another version, or a field is
            missing or of the wrong type.
    """
    content = decoded(path, remedy=remedy)
    found = content.get("format") if isinstance(content, dict) else None
    if found != version:
        raise JSONFileError(f"{path} has format {found!r}, this version reads {version!r}: {remedy}")
    return checked(content, shape, where=str(path), remedy=remedy)


def decoded(path: str | PathLike[str], *, remedy: str) -> Any:
    """The content of a JSON file, whatever it is. Raises JSONFileError."""
    file = Path(path)
    try:
        if file.exists() and not file.is_file():
            raise JSONFileError(f"{path} is no regular file: {remedy}")
        return msgspec.json.decode(file.read_bytes().removeprefix(b"\xef\xbb\xbf"))
    except OSError as error:
        raise JSONFileError(f"cannot read {path} ({error.strerror}): {remedy}") from None
    except (msgspec.DecodeError, RecursionError) as error:
        raise JSONFileError(f"{path} is not JSON ({error}): {remedy}") from None


def checked(content: Any, shape: type[Shape], *, where: str, remedy: str) -> Shape:
    """Decoded JSON as an instance of `shape`. Raises JSONFileError; where: begins its sentence."""
    try:
        return msgspec.convert(content, shape)
    except msgspec.ValidationError as error:
        place, rule = _sentence(str(error))
        raise JSONFileError(f"{where}{place}: {rule}: {remedy}") from None


def _sentence(text: str) -> tuple[str, str]:
    """Place and rule of msgspec's message, such as "Expected `str`, got `int` - at `$.name`"."""
    rule, _, place = text.partition(" - at ")
    place = place.strip("`").removeprefix("$").removeprefix(".")
    rule = re.sub(r"^Object missing required field `(\w+)`$", r"field '\1' is missing", rule)
    rule = re.sub(r"^Expected `([^`]+)`, got `([^`]+)`$", r"expected \1, found \2", rule)
    return f", {place}" if place else "", rule
