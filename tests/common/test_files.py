"""Files and journals: what cannot be what it claims is refused at once; nothing is half-written."""

import argparse
import json
import os
import resource
import socket
import stat
from contextlib import contextmanager

import msgspec
import pytest

from epv_env.common.files import Journal, JSONFileError, decoded, read_bytes, read_json, write_bytes
from epv_env.common.options import writable_file

REMEDY = "write it anew"


class Entry(msgspec.Struct):
    """A part of the file."""

    file: str
    rate: float


class Content(msgspec.Struct):
    """The file of these tests."""

    name: str
    entries: list[Entry]


GOOD = {"format": "test/1", "name": "a", "entries": [{"file": "b", "rate": 2}], "other": None}


def read(tmp_path, content):
    path = tmp_path / "file.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return read_json(path, Content, version="test/1", remedy=REMEDY)


@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_what_was_written_is_read(tmp_path, mark):
    found = read(tmp_path, mark + json.dumps(GOOD))
    assert found == Content(name="a", entries=[Entry(file="b", rate=2.0)])


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ({**GOOD, "format": "test/2"}, "has format 'test/2', this version reads 'test/1'"),
        ([], "has format None"),
        ("{", "is not JSON"),
        ("[" * 100_000, "is not JSON"),
        ({"format": "test/1", "entries": []}, "field 'name' is missing"),
        ({**GOOD, "name": 1}, ", name: expected str, found int"),
        ({**GOOD, "entries": [{"file": "b", "rate": "2"}]}, "entries[0].rate: expected float, found"),
    ],
)
def test_a_wrong_file_ends_in_one_sentence(tmp_path, content, sentence):
    with pytest.raises(JSONFileError) as caught:
        read(tmp_path, content)
    message = str(caught.value)
    assert sentence in message
    assert message.startswith(str(tmp_path / "file.json"))
    assert message.endswith(REMEDY)
    assert "\n" not in message


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"[" * 100_000 + b"]" * 100_000, "not JSON"),
        (b"[" * 300 + b"]" * 300, "more than 64 levels"),
        (b'{"a": ' + b"9" * 400 + b"}", "a whole number of 400 digits"),
        (b'{"a": ' + b"9" * 9000 + b"}", "a whole number of 9000 digits"),
        (b'{"a": 9223372036854775808}', "beyond 64 bits"),
        (b'{"a": 1e999}', "beyond double precision"),
        (b'{"a": NaN}', "NaN is no number"),
        (b'{"a": {"b": 1, "c": 2, "b": 3}}', "the field 'b' stands twice in an object"),
        (b'{"a": "\xff"}', "not JSON in UTF-8"),
        (b"", "not JSON"),
    ],
)
def test_senseless_json_is_refused(tmp_path, content, words):
    (tmp_path / "a.json").write_bytes(content)
    with pytest.raises(JSONFileError, match=words) as refusal:
        decoded(tmp_path / "a.json", remedy=REMEDY)
    assert str(refusal.value).endswith(REMEDY)
    assert "\n" not in str(refusal.value)


def test_pipes_and_devices_are_no_files(tmp_path):
    """They could block for ever, or never end."""
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", tmp_path):
        with pytest.raises(OSError, match="no regular file"):
            read_bytes(path)
        with pytest.raises(JSONFileError, match="no regular file"):
            decoded(path, remedy=REMEDY)
    with pytest.raises(JSONFileError, match="no regular file"):
        decoded("/dev/zero", remedy=REMEDY)


@contextmanager
def full_disk():
    """A limit on the size of files stands for the full disk: the system refuses to write on."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_file_of_forty_gigabytes_is_refused_unread(tmp_path):
    with (tmp_path / "sparse.json").open("wb") as stream:
        stream.truncate(40 * 10**9)
    with pytest.raises(JSONFileError, match=r"cannot read .*sparse\.json \(larger than .* bytes\)"):
        decoded(tmp_path / "sparse.json", remedy=REMEDY)


def fifo(path):
    os.mkfifo(path)


def listening(path):
    with socket.socket(socket.AF_UNIX) as end:
        end.bind(str(path))


def device(path):
    path.symlink_to("/dev/null")  # a node of its own takes root


def read_only(path):
    path.touch(mode=0o400)


@pytest.mark.parametrize("make", [fifo, listening, device, read_only, os.mkdir])
def test_only_a_regular_file_that_may_be_written_is_replaced(make, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # a socket's path is short
    path = tmp_path / "out"
    make(path.relative_to(tmp_path))
    before = path.lstat()
    with pytest.raises(OSError, match=f"cannot write: .*: .*{path}"):
        write_bytes(path, b"new")
    with pytest.raises(argparse.ArgumentTypeError):
        writable_file(str(path))
    assert (path.lstat().st_mode, path.lstat().st_ino) == (before.st_mode, before.st_ino)
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_keeps_its_mode_and_a_new_one_follows_the_umask(tmp_path):
    secret, new, link = (tmp_path / name for name in ("secret", "new", "link"))
    secret.touch(mode=0o600)
    link.symlink_to(secret)
    before = os.umask(0o027)
    try:
        write_bytes(link, b"secret")
        write_bytes(new, b"new")
    finally:
        os.umask(before)
    assert (link.is_symlink(), secret.read_bytes()) == (True, b"secret")
    assert [stat.S_IMODE(path.stat().st_mode) for path in (secret, new)] == [0o600, 0o640]


def test_a_full_disk_is_named_and_leaves_no_part(tmp_path):
    path = tmp_path / "result"
    path.write_bytes(b"before")
    with full_disk(), pytest.raises(OSError, match=f"cannot write: .*{path}"):
        write_bytes(path, bytes(10_000))
    assert path.read_bytes() == b"before"
    assert [each.name for each in tmp_path.iterdir()] == ["result"]


SUBJECT = {"recordings": ["a", "b"], "seed": 0}


@pytest.fixture
def path(tmp_path):
    """A journal of two results."""
    journal = Journal(tmp_path / "folder" / "journal.jsonl", SUBJECT)
    journal.add("one", {"z": [0.1, 1e-300], "converged": True})
    journal.add("two", None)
    return journal.path


def test_results_come_back(path):
    journal = Journal(path, SUBJECT)
    assert len(journal) == 2
    assert journal["one"] == {"z": [0.1, 1e-300], "converged": True}
    assert "two" in journal
    assert journal["two"] is None
    assert "three" not in journal


@pytest.mark.parametrize(
    ("subject", "difference"),
    [
        ({**SUBJECT, "seed": 1}, "seed 0, not 1"),
        ({"recordings": ["a"], "seed": 0}, r'recordings \["a", "b"\], not \["a"\]'),
        ({**SUBJECT, "plant": {"R": 43.0}}, 'plant null, not {"R": 43.0}'),
    ],
)
def test_another_subject_is_refused_with_what_differs_and_nothing_is_wiped(path, subject, difference):
    before = path.read_bytes()
    with pytest.raises(ValueError, match=rf"journal\.jsonl holds results with {difference}: go on with"):
        Journal(path, subject)
    with pytest.raises(ValueError, match=f"{difference}: restore the statement$"):
        Journal(path, subject, remedy="restore the statement")
    assert path.read_bytes() == before
    assert len(Journal(path, SUBJECT)) == 2


def test_only_the_first_of_many_differences_are_named(path):
    plant = dict.fromkeys("abcde", 1.0)
    Journal(path.with_name("plant"), {"plant": plant})
    message = r"with plant\.a 1\.0, not null, plant\.b .*, plant\.c .* and 2 more: go on"
    with pytest.raises(ValueError, match=message):
        Journal(path.with_name("plant"), {"plant": {}})


@pytest.mark.parametrize("content", ['{"format": "epv-journal/1"}\n', "a note\n", "[]\n", "no end"])
def test_a_file_that_is_no_journal_is_refused_and_stays(path, content):
    path.write_text(content)
    with pytest.raises(ValueError, match="does not begin as epv-journal/2 does: move or remove"):
        Journal(path, SUBJECT)
    assert path.read_text() == content


def test_an_empty_file_becomes_a_journal(path):
    path.write_text("")
    assert len(Journal(path, SUBJECT)) == 0
    Journal(path, SUBJECT).add("one", 1)
    assert Journal(path, SUBJECT)["one"] == 1


@pytest.mark.parametrize("torn", ['{"name": "three", "res', "{", '{"name": "three", "result": 1}'])
def test_a_torn_last_line_is_dropped_and_written_anew(path, torn):
    """A line without its end may lack digits, so even one that reads well is none."""
    with path.open("a") as stream:
        stream.write(torn)
    journal = Journal(path, SUBJECT)
    assert len(journal) == 2
    journal.add("three", 3)
    again = Journal(path, SUBJECT)
    assert len(again) == 3
    assert again["three"] == 3


def test_a_later_result_replaces_an_earlier_one(path):
    Journal(path, SUBJECT).add("one", 1)
    assert Journal(path, SUBJECT)["one"] == 1


@pytest.mark.parametrize(
    "change",
    [
        ('"z": [0.1', '"z": [0.2'),
        ('"converged": true', '"x": 1'),
        ('"check"', '"chec"'),
        ('"one"', "null"),
    ],
)
def test_a_changed_line_is_refused_with_its_number(path, change):
    path.write_text(path.read_text().replace(*change))
    before = path.read_bytes()
    with pytest.raises(ValueError, match=r"journal\.jsonl, line 2 is damaged: remove this line"):
        Journal(path, SUBJECT)
    assert path.read_bytes() == before


@pytest.mark.parametrize("shape", [lambda found: found["x"], len, lambda found: found.keys(), int])
def test_a_result_of_another_shape_is_refused_with_its_name(path, shape):
    """Such as a line from elsewhere, whole in itself."""
    journal = Journal(path, SUBJECT)
    assert journal.read("one", dict) == journal["one"]
    with pytest.raises(
        ValueError, match=r"journal\.jsonl: the result 'two' is of another shape: remove"
    ):
        journal.read("two", shape)
