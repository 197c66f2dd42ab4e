"""A journal gives back what was added, only to the subject it belongs to, and survives a killed run."""

import pytest

from epv_env.common.files import Journal

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


def test_another_subject_starts_anew(path):
    assert len(Journal(path, {**SUBJECT, "seed": 1})) == 0
    assert len(Journal(path, SUBJECT)) == 0


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
