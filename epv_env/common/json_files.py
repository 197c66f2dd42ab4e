"""JSON files: written whole; read with one sentence for each way in which a file can be wrong."""

import json
import math
import re
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from epv_env.common.files import read_bytes, write_text

Shape = TypeVar("Shape")

DEEPEST = 64
"""Levels of a file's objects and lists; ours have less than ten."""

LARGEST = 2**63
"""Whole numbers stay below, as in other programs that read the file."""


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


def decoded(path: str | PathLike[str], *, remedy: str, what: str = "", allow_nan: bool = False) -> Any:
    """The content of a JSON file, whatever it is.

    Args:
        path: the file; UTF-8, with or without a byte order mark.
        remedy: what to do about a file that cannot be used.
        what: names the kind of file in messages, before the path.
        allow_nan: whether the caller refuses NaN and infinities itself, with the field's name.

    Raises:
        JSONFileError: the file is missing, no regular file, not JSON, or of senseless depth or numbers.
    """
    file = f"{what} {path}".lstrip()
    try:
        return _parsed(read_bytes(Path(path)).decode("utf-8-sig"), allow_nan=allow_nan)
    except OSError as error:
        raise JSONFileError(f"cannot read {file} ({error.strerror}): {remedy}") from None
    except (ValueError, RecursionError) as error:
        raise JSONFileError(f"{file} is not JSON in UTF-8 ({error}): {remedy}") from None


def _parsed(text: str, *, allow_nan: bool) -> Any:
    """The content of a JSON text. Raises ValueError or RecursionError."""

    def whole(digits: str) -> int:
        if len(digits) > len(str(LARGEST)) or abs(int(digits)) >= LARGEST:
            raise ValueError(f"a whole number of {len(digits)} digits is beyond 64 bits")
        return int(digits)

    def number(digits: str) -> float:
        value = float(digits)
        if math.isinf(value):
            raise ValueError(f"the number {digits[:20]} is beyond double precision")
        return value

    def constant(name: str) -> float:
        if not allow_nan:
            raise ValueError(f"{name} is no number")
        return float(name)

    content = json.loads(text, parse_int=whole, parse_float=number, parse_constant=constant)
    _check_depth(content)
    return content


def _check_depth(content: Any) -> None:
    """Raises ValueError beyond DEEPEST levels, at which other functions would run out of stack."""
    level = [content]
    for _ in range(DEEPEST):
        nested = [
            each.values() if isinstance(each, dict) else each
            for each in level
            if isinstance(each, (dict, list))
        ]
        level = [inner for each in nested for inner in each]
        if not level:
            return
    raise ValueError(f"more than {DEEPEST} levels of objects and lists")


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
