"""Studies write the generated parts of their pages, and their short forms run."""

import json

import numpy as np
import pytest

from docs.studies.common import fill, study_options, study_parser, table
from docs.studies.coverage.study import coverage, main
from docs.studies.logs import study
from docs.studies.rare import statement
from identification.recordings.log_files import read_log

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


@pytest.mark.parametrize("edit", [{"episodes": 2000}, {"duration_s": 5.0}, {"scenario": "steps"}])
def test_an_edited_statement_wipes_no_finished_batches(tmp_path, monkeypatch, edit):
    files = {name: tmp_path / getattr(statement, name).name for name in ("STATEMENT", "RESULTS")}
    files["RESULTS"].write_bytes(statement.RESULTS.read_bytes())
    content = json.loads(statement.STATEMENT.read_text())
    files["STATEMENT"].write_text(json.dumps(content | edit))
    for name, path in files.items():
        monkeypatch.setattr(statement, name, path)
    ((name, value),) = edit.items()
    difference = f"statement.{name} {json.dumps(content[name])}, not {json.dumps(value)}"
    with pytest.raises(ValueError, match=f"statement.jsonl holds results with {difference}: restore"):
        statement.main([])
    assert files["RESULTS"].read_bytes() == statement.RESULTS.read_bytes()


def test_shares_are_those_of_known_distances():
    """Squared distances of chi-square's law: 95 % lie in the region, fewer if they are doubled."""
    distance = np.random.default_rng(0).chisquare(4, 2000)
    campaigns = [
        {"symbols": ["a", "b", "c", "d"], "distance": d, "inside": [True, True, True, False]}
        for d in distance
    ]
    found = coverage(campaigns)
    assert found["joint region"]["low"] < 0.95 < found["joint region"]["high"]
    doubled = coverage([each | {"distance": 2 * each["distance"]} for each in campaigns])
    assert doubled["joint region"]["high"] < 0.9
    assert found["interval of d"]["share"] == 0.0


@pytest.mark.slow
def test_the_short_form_writes_results_and_page(tmp_path):
    assert main(["--quick", "--out", str(tmp_path)]) == 0
    found = json.loads((tmp_path / "coverage.json").read_text(encoding="utf-8"))
    assert set(found) >= {"joint region", "interval of alphaMV"}
    assert "| joint region |" in (tmp_path / "README.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_deviating_law_changes_what_is_logged_and_none_does_not(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "DURATION", 1.0)
    valve = study.drawn(0) | {"seeds": [3], "effects": {"control_chamber_heat": {"tau_3": 0.01}}}

    def logged(name: str, **changes: float) -> np.ndarray:
        study.log_drives(valve | changes, tmp_path / name)
        return read_log(tmp_path / name).drives[0].p3

    none, strong = logged("none", deviation=0.0), logged("strong", deviation=0.5)
    monkeypatch.setattr(study, "deviate", lambda valves, deviation: None)
    plain = logged("plain")
    assert np.max(np.abs(none - plain)) < 500.0  # Pa: a reading's last digit is 10
    assert np.max(np.abs(strong - plain)) > 5e3


@pytest.mark.slow
def test_the_short_form_writes_the_page(tmp_path):
    assert study.main(["--quick", "--out", str(tmp_path)]) == 0
    text = (tmp_path / "README.md").read_text(encoding="utf-8")
    assert "| Valves, each driven for five minutes | 1 |" in text
    assert study.main(["--quick", "--out", str(tmp_path)]) == 0  # from the journal alone
