"""A spoilt file or option is read or refused in one sentence; nothing crashes, writes, or runs."""

import argparse
import importlib
import io
import json
import os
import re
import tempfile
import zipfile
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("jinja2")

from epv_env.common.commands import commands, main
from epv_env.common.files import _checksum
from epv_env.common.options import Number, parser_of
from tests.fuzzed_files import FORMATS, Use, good

pytestmark = pytest.mark.training
PACKAGES = [name for name in ("identification.commands", "training.commands") if find_spec(name)]

WRONG_VALUES: tuple[Any, ...] = (
    None, True, -1, 1.5, 1e300, 10**30, float("nan"), float("inf"), "", "x", "\0", "é" * 300, [], {},
    [[]], [None] * 50, {"": {}}, "../../etc/passwd", 2**63,
)  # fmt: skip


NO_NUMBERS = ("-1", "nan", "1e999", "9" * 400, "", "x")
"""What no option that takes a number takes: negative, infinite, beyond sense, or no number."""


def damaged_bytes(content: bytes, rng: np.random.Generator) -> bytes:
    """The content with bytes cut off, put in, changed, or repeated."""
    place = int(rng.integers(max(len(content), 1)))
    return [
        content[:place],
        content[:place] + rng.bytes(int(rng.integers(1, 20))) + content[place:],
        content[:place] + rng.bytes(1) + content[place + 1 :],
        content[: place + int(rng.integers(1, 200))] + content[place:],
        [b"[", b"{", b'"', b"9", b"\xff"][place % 5] * int(rng.integers(1, 200_000)),
    ][int(rng.integers(5))]


def damaged_value(content: bytes, rng: np.random.Generator) -> bytes:
    """JSON with one value removed or replaced."""
    value = json.loads(content)
    places = list(_places(value))
    holder, key = places[int(rng.integers(len(places)))]
    if rng.random() < 0.25:
        del holder[key]
    else:
        holder[key] = WRONG_VALUES[int(rng.integers(len(WRONG_VALUES)))]
    return json.dumps(value).encode()


def damaged_line(content: bytes, rng: np.random.Generator) -> bytes:
    """A journal of which a line is damaged so, with the right check: whoever edits it can compute it."""
    header, line, *more = content.splitlines()
    entry = json.loads(line)
    del entry["check"]
    entry = json.loads(damaged_value(json.dumps(entry).encode(), rng))
    own, result = (json.dumps(entry.get(key)) for key in ("name", "result"))
    line = f'{{"name": {own}, "result": {result}, "check": {_checksum(own, result)}}}'
    return b"\n".join([header, line.encode(), *more, b""])


ODD_NUMBERS = [*b"NaN 1e999 -0 1e308 -1e308 1e-320 0x1F =1+1".split(), b"9" * 5000, b""]
ODD_BYTES = [np.float32(value).tobytes() for value in (np.nan, np.inf, -1e38, -1.0)]


def damaged_number(content: bytes, rng: np.random.Generator) -> bytes:
    """A number of a text, or four bytes of arrays, replaced by one beyond sense."""
    begin, odd = int(rng.integers(len(content))), ODD_BYTES
    end, numbers = begin + 4, list(re.finditer(rb"-?\d+(\.\d+)?", content))
    if content.isascii() and numbers:
        (begin, end), odd = numbers[int(rng.integers(len(numbers)))].span(), ODD_NUMBERS
    return content[:begin] + odd[int(rng.integers(len(odd)))] + content[end:]


def _places(value: Any):
    """Every (holder, key) within a value."""
    for key in list(value) if isinstance(value, dict) else range(len(value)):
        yield value, key
        if isinstance(value[key], (dict, list)):
            yield from _places(value[key])


def other_content(executed: Path, content: bytes, rng: np.random.Generator) -> bytes:
    """What is no such file: a pickle that makes a folder, alone and within an archive, and others."""
    trap, archive = f"cos\nmkdir\n(V{executed}\ntR.".encode(), io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("archive/data.pkl", trap)
        file.writestr("zeros", bytes(2**24))
    others = [
        trap, archive.getvalue(), b"", b"{}", b"null", b"\n\n",
        content * 2, content.replace(b"{", b'{"format": "x", ', 1), b"\xef\xbb\xbf" + content,
        b"1," * 10**5, b'"' + b"x" * 10**6, b"\xff\xfe" + content,
        (2**20).to_bytes(8, "little") + b"[" * 2**20,
    ]  # fmt: skip
    return others[int(rng.integers(len(others)))]


def other_file(path: Path, outside: Path, rng: np.random.Generator) -> None:
    """In the file's place a link out of the folder, to itself, or without an end, a folder, a pipe."""
    path.unlink()
    links = [outside, path, outside.with_name("none"), Path("/dev/zero")]
    makers = [path.mkdir, partial(os.mkfifo, path), *(partial(path.symlink_to, link) for link in links)]
    makers[int(rng.integers(len(makers)))]()


def spoil(path: Path, outside: Path, rng: np.random.Generator) -> None:
    """Edit a good file as one does who wants code run, a crash, or a false result."""
    content, kind = path.read_bytes(), int(rng.integers(8))
    own = {".json": [damaged_value], ".jsonl": [damaged_line]}.get(path.suffix, [])
    damages = [damaged_bytes, damaged_number, *own, *own]
    if kind == 0:
        other_file(path, outside, rng)
    elif kind < 3:
        path.write_bytes(other_content(outside.with_name("executed"), content, rng))
    else:
        path.write_bytes(damages[int(rng.integers(len(damages)))](content, rng))


def refusal(use: Use, path: Path) -> str:
    """The sentence with which a file is refused; "still good" if it is not."""
    try:
        use(path)
    except (ValueError, OSError) as found:
        return str(found)
    return "still good"


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")  # a traceback
@pytest.mark.parametrize(
    ("first", "count"), [(0, 8), pytest.param(8, 80, marks=pytest.mark.slow)], ids=["few", "many"]
)
@pytest.mark.parametrize("name", FORMATS)
def test_a_spoilt_file_is_refused_in_a_sentence(name, first, count):
    """All of them: 2,000 files. No code runs, and no file comes, goes, or is written outside."""
    for seed in range(first, first + count):
        with tempfile.TemporaryDirectory() as place:
            folder, outside = Path(place) / "folder", Path(place) / "outside"
            for path, content in good(name).items():
                (folder / path).parent.mkdir(parents=True, exist_ok=True)
                (folder / path).write_bytes(content)
            outside.write_bytes(b"secret")
            spoil(folder / name, outside, np.random.default_rng(seed))
            files = sorted(Path(place).rglob("*"))
            assert "\n" not in refusal(FORMATS[name][1], folder / name), seed
            assert sorted(Path(place).rglob("*")) == files, seed
            assert outside.read_bytes() == b"secret", seed


def number_options(parser: argparse.ArgumentParser) -> list[str]:
    """The options of a parser that take a number."""
    return [
        action.option_strings[-1]
        for action in parser._actions
        if action.option_strings and (action.type in (int, float) or isinstance(action.type, Number))
    ]


@pytest.mark.parametrize("name", commands(PACKAGES))
def test_a_number_without_sense_is_refused_by_its_option(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    parser = parser_of(importlib.import_module(commands(PACKAGES)[name]), name)
    operands = [
        "nowhere" for action in parser._actions if not action.option_strings and action.nargs != "*"
    ]
    for option in number_options(parser):
        for value in NO_NUMBERS:
            line = [name, *operands, "--out", "fuzz-out", f"{option}={value}"]
            try:
                status = main(PACKAGES, program="epv", arguments=line)
            except SystemExit as end:
                status = end.code
            last = (capsys.readouterr().err.strip().splitlines() or [""])[-1]
            assert status == 2, (option, value)
            assert option.strip("-").replace("-", " ") in last.replace("-", " "), (option, value, last)
    assert list(tmp_path.iterdir()) == []
