"""Studies write the generated parts of their pages, a trial run those of a copy."""

import pytest

from docs.studies.common import fill, study_options, study_parser, table

PAGE = "# Speed\n\n<!-- generated: rows -->\nold\n<!-- end: rows -->\n\nWritten by hand.\n"


def test_a_part_is_replaced_and_the_rest_stays(tmp_path):
    page = tmp_path / "README.md"
    page.write_text(PAGE)
    rows = table(["Valve", "Time"], [["left", "1 ms"], ["right", "2 ms"]])
    for _ in range(2):
        fill(page, {"rows": rows})
        assert page.read_text() == PAGE.replace("old", rows)
    assert rows.splitlines()[1:3] == ["| --- | --- |", "| left | 1 ms |"]


@pytest.mark.parametrize("text", ["", "<!-- generated: rows -->\nno end"])
def test_a_page_without_the_markers_is_refused(tmp_path, text):
    page = tmp_path / "README.md"
    page.write_text(text)
    with pytest.raises(ValueError, match="generated: rows"):
        fill(page, {"rows": "new"})
    assert page.read_text() == text


def test_a_trial_run_works_on_a_copy_of_the_page(tmp_path):
    folder, out = tmp_path / "speed", tmp_path / "out"
    folder.mkdir()
    (folder / "README.md").write_text(PAGE)
    options = study_options(study_parser("Speed.", folder), ["--quick", "--out", str(out)])
    fill(options.out / "README.md", {"rows": "new"})
    assert (folder / "README.md").read_text() == PAGE
    assert "new" in (out / "README.md").read_text()
    assert options.work == out
