"""Files: written whole or not at all; JSON read with one sentence for each way to be wrong."""

import errno
import hashlib
import json
import math
import os
import re
import secrets
import shutil
import stat
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

import msgspec

LARGEST_FILE = 2**30
"""Size of the largest file that is read [bytes]: half an hour of the bench at 20 kHz as text."""


def read_bytes(path: Path) -> bytes:
    """The content of a regular file. Raises OSError, also for a pipe or a device, which could block."""
    found = path.stat()
    if not stat.S_ISREG(found.st_mode):
        raise OSError(errno.EINVAL, "no regular file", str(path))
    if found.st_size > LARGEST_FILE:
        raise OSError(errno.EFBIG, f"larger than {LARGEST_FILE:,} bytes", str(path))
    return path.read_bytes()


def digest(content: bytes) -> str:
    """Sixteen digits that differ for different content."""
    return hashlib.sha256(content).hexdigest()[:16]


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically: a reader finds the old content or the new, never a part."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, content: bytes) -> None:
    """`write_text` for bytes. A new file has the mode that the umask leaves; another keeps its own.

    Raises OSError with the path, also where the disk is full; see `check_writable`.
    """
    check_writable(path)
    target = Path(os.path.realpath(path))  # a link stays one
    temporary = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
    try:
        with _named(path):
            target.parent.mkdir(parents=True, exist_ok=True)
            with temporary.open("xb") as stream:
                if target.exists():
                    os.fchmod(stream.fileno(), stat.S_IMODE(target.stat().st_mode))
                stream.write(content)
            os.replace(temporary, target)
    finally:
        with suppress(OSError):
            temporary.unlink()


TEMPORARY = re.compile(r"\..+\.[0-9a-f]{8}")
"""Names of what is being written: hidden, with a random end."""


def remove_leftovers(folder: Path) -> None:
    """Remove what killed writers left in a folder into which nobody else writes."""
    for path in [path for path in folder.rglob(".*") if TEMPORARY.fullmatch(path.name)]:
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)  # it may have gone with its folder


def check_writable(path: Path) -> None:
    """Raises OSError unless there is nothing at the path, or a regular file that may be written."""
    with _named(path):
        if not path.exists():
            return
        mode = path.stat().st_mode
        if not stat.S_ISREG(mode):
            raise OSError(errno.EINVAL, "what is there is no regular file: give another name")
        if not mode & 0o222 or not os.access(path, os.W_OK):  # root may write whatever the mode says
            raise OSError(errno.EACCES, "the file is read-only: give another name, or chmod it")


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Give the system's errors the path of what is written: that of a full disk has none."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, f"cannot write: {error.strerror or error}", str(path)) from None


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
        raise JSONFileError(f"{path} has format {found!r:.40}, this version reads {version!r}: {remedy}")
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

    def fields(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for name, value in pairs:
            if name in found:  # programs disagree which of the two counts
                raise ValueError(f"the field {name[:40]!r} stands twice in an object")
            found[name] = value
        return found

    content = json.loads(
        text, parse_int=whole, parse_float=number, parse_constant=constant, object_pairs_hook=fields
    )
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


JOURNAL = "epv-journal/2"
"""Form of a journal."""

SAME_SUBJECT = "go on with the same, choose another --out, or remove the file"

SHOWN = 3
"""Differences between two subjects that a message names."""


def _checksum(name: str, result: str) -> int:
    """Of a line of a journal, name and result as JSON: what is read back is what was added."""
    return zlib.crc32(f"[{name}, {result}]".encode())


def _changes(earlier: Any, now: Any, name: str = "") -> list[str]:
    """Where two decoded subjects differ, each as "plant.parameters.R 42.0, not 43.0"."""
    if isinstance(earlier, dict) and isinstance(now, dict):
        return [
            change
            for key in sorted({*earlier, *now})
            for change in _changes(earlier.get(key), now.get(key), f"{name}.{key}")
        ]
    texts = [json.dumps(each) for each in (earlier, now)]
    if texts[0] == texts[1]:
        return []
    return ["{} {:.40}, not {:.40}".format(name.removeprefix(".subject."), *texts)]


class Journal:
    """Results by name in a JSON Lines file whose first line says what they belong to."""

    def __init__(self, path: Path, subject: dict[str, Any], remedy: str = SAME_SUBJECT):
        """A new journal, or the one that is there.

        Args:
            path: of the file.
            subject: everything that the results depend on.
            remedy: what to do about a journal of another subject.

        Raises ValueError if the file is no journal, belongs to another subject, or a line is damaged;
        OSError if it is no regular file. What is finished is never wiped.
        """
        self.path = path
        self._found: dict[str, Any] = {}
        header = json.dumps({"format": JOURNAL, "subject": subject}, sort_keys=True)
        content = read_bytes(path) if path.exists() or path.is_symlink() else b""
        complete = content[: content.rfind(b"\n") + 1]  # the last line of a killed run may be torn
        if content:
            self._check_subject(complete.partition(b"\n")[0], json.loads(header), remedy)
        for number, line in enumerate(complete.split(b"\n")[1:-1], start=2):
            name, result = self._entry(line, number)
            self._found[name] = result
        if not content or complete != content:
            write_bytes(path, complete or f"{header}\n".encode())

    def _check_subject(self, line: bytes, header: dict[str, Any], remedy: str) -> None:
        """Raise ValueError if a first line is another than the header of these results."""
        try:
            found = json.loads(line)
        except (ValueError, RecursionError):
            found = None
        if not isinstance(found, dict) or found.get("format") != JOURNAL:
            raise ValueError(f"{self.path} does not begin as {JOURNAL} does: move or remove the file")
        if changes := _changes(found, header):
            more = f" and {len(changes) - SHOWN} more" if len(changes) > SHOWN else ""
            raise ValueError(
                f"{self.path} holds results with {', '.join(changes[:SHOWN])}{more}: {remedy}"
            )

    def _entry(self, line: bytes, number: int) -> tuple[str, Any]:
        """Name and result in a line of the file. Raises ValueError if it is damaged."""
        try:
            entry = _parsed(line.decode(), allow_nan=True)
            name, result = entry["name"], entry["result"]
            if isinstance(name, str) and entry["check"] == _checksum(*map(json.dumps, (name, result))):
                return name, result
        except (ValueError, KeyError, TypeError, RecursionError):
            pass
        raise ValueError(
            f"{self.path}, line {number} is damaged: remove this line, and its result is computed again"
        )

    def __contains__(self, name: str) -> bool:
        return name in self._found

    def __getitem__(self, name: str) -> Any:
        return self._found[name]

    def __len__(self) -> int:
        return len(self._found)

    def read(self, name: str, as_shape: Callable[[Any], Shape]) -> Shape:
        """A result as `as_shape` makes it. Raises ValueError if it is of another shape."""
        try:
            return as_shape(self._found[name])
        except (AttributeError, KeyError, TypeError, ValueError):
            raise ValueError(
                f"{self.path}: the result {name!r} is of another shape: remove its line, and it is "
                "computed again"
            ) from None

    def add(self, name: str, result: Any) -> None:
        """Keep a result, JSON-ready; it is on the disk when this returns."""
        with _named(self.path), self.path.open("a", encoding="utf-8") as stream:
            own, text = json.dumps(name), json.dumps(result)
            check = _checksum(own, text)
            stream.write(f'{{"name": {own}, "result": {text}, "check": {check}}}\n')
        self._found[name] = result
