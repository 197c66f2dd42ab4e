"""The tables of the blind rounds are those of the archive, which the page names by its digest."""

import hashlib
import json
import shutil

import pytest

from docs.blind import collect, monitored
from docs.blind.collect import ARCHIVE, FOLDER, main, packed, table, unpacked
from docs.blind.opened import counts, judged, labels_of, reliability

ANSWER = {
    "verdict": "known", "seconds": 41.2,
    "causes": [{"effects": ["a", "b"], "probability": 0.97}, {"effects": ["c"], "probability": 0.02}],
    "gap": {"nominal": 12.34, "recalibrated": 2.0, "with_cause": 1.001},
}  # fmt: skip


def test_the_archive_is_the_one_that_the_page_names_and_gives_the_tables():
    archive = (FOLDER / ARCHIVE).read_bytes()
    assert hashlib.sha256(archive).hexdigest() in (FOLDER / "README.md").read_text(encoding="utf-8")
    files = unpacked(archive)
    rounds = {name.split("/")[0] for name in files}
    assert rounds == {each.stem for each in FOLDER.glob("*.csv") if "-monitor" not in each.stem}
    for name in rounds:
        assert (FOLDER / f"{name}.csv").read_text(encoding="utf-8") == table(files, name)


def test_a_round_is_added_or_replaced_and_the_others_stay(tmp_path, monkeypatch, capsys):
    page = tmp_path / "docs"
    shutil.copytree(FOLDER, page)
    monkeypatch.setattr(collect, "FOLDER", page)
    (tmp_path / "answers/case-01").mkdir(parents=True)
    (tmp_path / "answers/case-01/gap.json").write_text(json.dumps(ANSWER))
    before = unpacked((page / ARCHIVE).read_bytes())
    for _ in range(2):
        assert main(["round-99", str(tmp_path / "answers")]) == 0
        archive = (page / ARCHIVE).read_bytes()
        assert unpacked(archive) == before | {"round-99/case-01.json": json.dumps(ANSWER).encode()}
        assert archive == packed(dict(reversed(unpacked(archive).items())))
    row = (page / "round-99.csv").read_text().splitlines()[1]
    assert row == "case-01,known,a + b; c,0.97; 0.02,12.3,2,1,41"
    with pytest.raises(ValueError, match="holds no answer"):
        main(["round-99", str(tmp_path / "answers/case-01/none")])


def said(verdict, effects, probability):
    causes = [{"effects": effects, "probability": probability}]
    return {"verdict": verdict, "causes": causes}


LEAK, BOTH = ["seat_leak"], ["seat_leak", "command_delay"]


@pytest.mark.parametrize(
    ("truth", "answer", "kind", "right", "named"),
    [
        (LEAK, said("known", LEAK, 0.95), "cause", True, True),
        (BOTH, said("partial", LEAK, 0.8), "cause", True, True),
        (LEAK, said("known", BOTH, 0.95), "cause", False, True),
        (LEAK, said("unknown", LEAK, 0.1), "cause", True, False),
        ([], said("no_gap", LEAK, 0.001), "none", False, False),
        (["piston_seal_leak"], said("known", LEAK, 0.95), "stranger", False, True),
        (LEAK, {"verdict": "failed"}, "cause", False, False),
    ],
)
def test_a_first_cause_is_right_if_it_names_nothing_untrue(truth, answer, kind, right, named):
    found = judged(truth, answer)
    assert (found["kind"], found["right"], found["named"]) == (kind, right, named)


def test_opened_cases_are_counted_by_kind_and_by_stated_probability():
    cases = [judged(LEAK, said("known", LEAK, p)) for p in (0.9, 1.0, 0.5)]
    cases += [judged(LEAK, said("partial", BOTH, 0.5)), judged([], said("unknown", LEAK, 0.1))]
    counted = dict(counts(cases))
    assert counted["right cause named"] == "3 of 4"
    assert counted["wrong cause named"] == "1 of 4"
    assert counted["alarm without an effect"] == "1 of 1"
    assert [row[1:] for row in reliability(cases)] == [
        ["-", "0 of 0"], ["-", "0 of 0"], ["0.50", "1 of 2"], ["-", "0 of 0"], ["0.95", "2 of 2"],
    ]  # fmt: skip


def test_a_round_without_labels_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"has no labels\.json: give the folder of a round"):
        labels_of(tmp_path)


def test_a_monitor_is_right_where_the_interval_holds_the_drive_and_the_cause_is_named():
    labels = {
        "late": {"effects": ["seat_leak"], "since_drive": 3, "until_drive": 4},
        "whole": {"effects": ["eddy_current"], "since_drive": 1},
        "none": {"effects": [], "since_drive": None},
    }
    blank = dict.fromkeys(monitored.COLUMNS, "")
    right = {"since": 2, "earliest": 2, "latest": 3, "mended": 4, "what": "seat_leak"}
    answers = {
        "late": blank | right, "whole": blank | {"from the start": "eddy_current"}, "none": blank,
    }  # fmt: skip
    assert [row[1] for row in monitored.counts(answers, labels)] == ["0 of 2", *["1 of 1"] * 4]
    wrong = {"late": blank | right | {"latest": 2, "mended": "", "what": "seat_leak (unknown)"}}
    assert [row[1] for row in monitored.counts(wrong, labels)] == ["0 of 0", *["0 of 1"] * 3, "0 of 0"]
