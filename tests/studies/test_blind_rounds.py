"""The tables of the blind rounds are those of the archive, which the page names by its digest."""

import hashlib
import json
import shutil

import pytest

from docs.blind import collect
from docs.blind.collect import ARCHIVE, FOLDER, main, packed, table, unpacked

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
    assert rounds == {path.stem for path in FOLDER.glob("*.csv")}
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
