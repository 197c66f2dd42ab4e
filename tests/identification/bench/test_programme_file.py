"""Programme files: what is written is read back and run; what is wrong is refused in one sentence."""

import json
from dataclasses import replace

import numpy as np
import pytest

from identification.__main__ import main
from identification.bench.programmes import (
    DIAGNOSIS_SUITE,
    FORMAT,
    Programme,
    ProgrammeError,
    load_programmes,
    save_programmes,
)
from identification.recordings.campaign_files import read_campaign
from identification.report_2003 import Case

SHORT = Programme(
    name="short", role="calibration", p1=9.3e5, p2=5.1e5, U_on=22.5,
    case=Case(name="short", openings=(0.02, 0.035), duration=0.3, first=0.06, pause=0.07),
)  # fmt: skip


def entry(**changes):
    """The one programme of a good file, with changes; None leaves a field out."""
    good = {
        "name": "next", "role": "calibration", "supply_bar": 9.0, "circuit_bar": 5.0, "voltage_V": 24,
        "first_ms": 50, "openings_ms": [400], "pause_ms": 209, "duration_ms": 1200,
    }  # fmt: skip
    return {field: value for field, value in {**good, **changes}.items() if value is not None}


def written(path, *entries):
    path.write_text(json.dumps({"format": FORMAT, "programmes": list(entries)}))
    return path


def test_what_is_written_is_read_back(tmp_path):
    suite = tuple(replace(p, case=replace(p.case, name=p.name)) for p in (*DIAGNOSIS_SUITE, SHORT))
    save_programmes(suite, tmp_path / "suite.json")
    assert load_programmes(tmp_path / "suite.json") == suite


def test_the_bench_runs_a_file(tmp_path):
    save_programmes([SHORT], tmp_path / "next.json")
    out = tmp_path / "campaign"
    assert main(["bench", "--programme", str(tmp_path / "next.json"), "--out", str(out)]) == 0
    (recording,) = read_campaign(out).recordings
    assert (recording.name, recording.role, len(recording)) == ("short", "calibration", 601)
    assert np.mean(recording.p1[:100]) == pytest.approx(9.3e5, abs=2e3)
    assert np.mean(recording.p2[:100]) == pytest.approx(5.1e5, abs=2e3)
    assert np.sum(~recording.energised) == 40 + 70


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": "../next"}, "does not name a file"),
        ({"role": "train"}, "unknown role 'train'"),
        ({"supply_bar": 17}, "supply_bar = 17.0 is outside 1 to 16"),
        ({"circuit_bar": 9.5}, "circuit_bar = 9.5 is outside 1 to 9: "),
        ({"voltage_V": 0}, "voltage_V = 0.0 is outside 1 to 32"),
        ({"first_ms": 20}, "first_ms = 20.0 is outside 40 to"),
        ({"openings_ms": []}, "give at least one"),
        ({"openings_ms": [700, 700]}, "ends at 1659 ms, beyond duration_ms = 1200"),
        ({"duration_ms": 1e6}, "duration_ms = 1000000.0 is outside"),
    ],
)
def test_a_wrong_field_is_refused(changes, message, tmp_path):
    path = written(tmp_path / "next.json", entry(name="first"), entry(**changes))
    with pytest.raises(ProgrammeError, match=message) as refusal:
        load_programmes(path)
    assert str(refusal.value).startswith(f"{path}, programme 2")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "is not JSON"),
        ("[]", "has format None, this version reads 'epv-programme/1'"),
        (json.dumps({"format": FORMAT}), "field 'programmes' is missing"),
        (json.dumps({"format": FORMAT, "programmes": []}), "programmes is empty"),
        (json.dumps({"format": FORMAT, "programmes": [entry(supply_bar=True)]}), "found bool"),
        (json.dumps({"format": FORMAT, "programmes": [entry(supply_bar=float("nan"))]}), "NaN"),
        (json.dumps({"format": FORMAT, "programmes": [entry(name=None)]}), "field 'name' is missing"),
        (json.dumps({"format": FORMAT, "programmes": [entry(), entry()]}), "two programmes are named"),
    ],
)
def test_a_file_that_is_none_is_refused(text, message, tmp_path):
    (tmp_path / "next.json").write_text(text)
    with pytest.raises(ProgrammeError, match=message):
        load_programmes(tmp_path / "next.json")


def test_nothing_is_written_that_could_not_be_read_back(tmp_path):
    with pytest.raises(ProgrammeError, match="circuit_bar"):
        save_programmes([replace(SHORT, p2=2 * SHORT.p1)], tmp_path / "next.json")
    assert not (tmp_path / "next.json").exists()
