"""The study of operation logs: its valves deviate from the fitted laws, and its short form runs."""

import numpy as np
import pytest

from docs.studies.logs import study
from identification.recordings.log_files import read_log

pytestmark = pytest.mark.slow


def test_a_deviating_law_changes_what_is_logged_and_none_does_not(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "DURATION", 1.0)
    valve = study.drawn(0) | {"seeds": [3], "effects": {"control_chamber_heat": {"tau_3": 0.01}}}

    def logged(name: str, **changes: float) -> np.ndarray:
        study.log_drives(valve | changes, tmp_path / name)
        return read_log(tmp_path / name).drives[0].p3

    none, strong = logged("none", deviation=0.0), logged("strong", deviation=0.5)
    monkeypatch.setattr(study, "deviate", lambda valves, deviations: None)
    plain = logged("plain")
    assert np.max(np.abs(none - plain)) < 500.0  # Pa: a reading's last digit is 10
    assert np.max(np.abs(strong - plain)) > 5e3


def test_the_short_form_writes_the_page(tmp_path):
    assert study.main(["--quick", "--out", str(tmp_path)]) == 0
    text = (tmp_path / "README.md").read_text(encoding="utf-8")
    assert "| Valves, each driven for five minutes | 1 |" in text
    assert study.main(["--quick", "--out", str(tmp_path)]) == 0  # from the journal alone
