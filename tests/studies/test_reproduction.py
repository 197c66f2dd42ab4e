"""The page of the report's tables shows what was computed."""

import json

import pytest

from docs.studies.reproduction import study
from docs.studies.reproduction.study import FOLDER, page_parts


def test_the_page_shows_the_published_results():
    page = (FOLDER / "README.md").read_text(encoding="utf-8")
    published = json.loads((FOLDER / "reproduce.json").read_text(encoding="utf-8"))
    assert all(part in page for part in page_parts(published).values())


@pytest.mark.slow
def test_the_short_form_gives_the_published_tables(tmp_path):
    """All that does not depend on the number of searches is equal; the estimates agree."""
    published = json.loads((FOLDER / "reproduce.json").read_text(encoding="utf-8"))
    assert study.main(["--quick", "--out", str(tmp_path)]) == 0
    found = json.loads((tmp_path / "reproduce.json").read_text(encoding="utf-8"))
    assert found["comparison"].keys() == published["comparison"].keys()
    for name in ("table8", "table9"):
        for symbol, row in published[name].items():
            assert found[name][symbol] == pytest.approx(row, rel=1e-6)
    for method, values in published["virtual_bench"]["table12"].items():
        assert found["virtual_bench"]["table12"][method] == pytest.approx(values, rel=1e-4)
