"""The page of the report's tables shows what is computed."""

import json

import pytest

from docs.studies.reproduction.study import FOLDER, agreement, main


def test_the_study_gives_the_published_figures(tmp_path):
    assert main(["--out", str(tmp_path)]) == 0
    found, published = (
        json.loads((folder / "reproduce.json").read_text(encoding="utf-8"))
        for folder in (tmp_path, FOLDER)
    )
    for name in ("table8", "table9"):
        for symbol, row in published[name].items():
            assert found[name][symbol] == pytest.approx(row, rel=1e-6)
    assert agreement(published["comparison"]) in (FOLDER / "README.md").read_text(encoding="utf-8")
