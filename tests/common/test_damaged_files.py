"""Files that cannot be what they claim: refused in one sentence, at once, and nothing half-written."""

import json
import os
import resource

import pytest

from epv_env.common.files import Journal, JSONFileError, decoded, read_bytes, write_bytes

REMEDY = "write it anew"


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


def test_a_full_disk_is_named_and_leaves_no_part(tmp_path):
    """A limit on the size of files stands for the full disk: the system refuses to write on."""
    path = tmp_path / "result"
    path.write_bytes(b"before")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with pytest.raises(OSError, match=f"cannot write: .*{path}"):
            write_bytes(path, bytes(10_000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert path.read_bytes() == b"before"
    assert [each.name for each in tmp_path.iterdir()] == ["result"]


@pytest.mark.parametrize("line", [b"[]", b"{", b'{"name": 3, "result": 1}', b'{"name": "a"}', b"\xff"])
def test_a_damaged_journal_names_file_line_and_remedy(tmp_path, line):
    path = tmp_path / "finished.jsonl"
    Journal(path, {"seed": 0}).add("one", 1)
    path.write_bytes(path.read_bytes() + line + b"\n" + json.dumps({"name": "b"}).encode() + b"\n")
    before = path.read_bytes()
    with pytest.raises(ValueError, match=r"finished\.jsonl, line 3 is damaged: remove this line"):
        Journal(path, {"seed": 0})
    assert path.read_bytes() == before
