"""A versioned JSON file is read as it was written; a wrong one ends in one sentence."""

import json
import os

import msgspec
import pytest

from epv_env.common.files import JSONFileError, read_json

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
        (
            {**GOOD, "entries": [{"file": "b", "rate": "2"}]},
            "entries[0].rate: expected float, found str",
        ),
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


def test_no_file_and_a_pipe_are_refused(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path, sentence in ((tmp_path / "none.json", "No such file"), (pipe, "no regular file")):
        with pytest.raises(JSONFileError, match=sentence):
            read_json(path, Content, version="test/1", remedy=REMEDY)
