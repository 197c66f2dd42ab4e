"""Time per decision is measured, is the decision's own, and comes as a table."""

import json
import time

import numpy as np
import pytest

from controllers.hysteresis import Hysteresis
from training import timing
from training.timing import decision_times, timing_table

pytestmark = pytest.mark.training


class Slow(Hysteresis):
    """Computes for a millisecond before it decides."""

    def act(self, observations):
        begin = time.process_time()
        while time.process_time() - begin < 1e-3:
            pass
        return super().act(observations)


def test_what_a_decision_computes_is_what_is_timed():
    quick, slow = (
        decision_times(kind(open_below=-0.1, shut_above=0.1), decisions=40, options={})
        for kind in (Hysteresis, Slow)
    )
    assert len(quick) == 40
    assert np.min(slow) > 1e-3
    assert np.median(quick) < 1e-3


def test_the_table_holds_median_tail_worst_and_share():
    table = timing_table({"a": np.r_[np.full(999, 1e-4), 2.5e-3]}, period=5e-3)
    row = table.iloc[0]
    assert row["median_us"] == pytest.approx(100)
    assert row["worst_us"] == pytest.approx(2500)
    assert row["worst_share_of_period"] == pytest.approx(0.5)
    assert row["median_us"] <= row["p99.9_us"] <= row["worst_us"]


def test_the_command_writes_what_it_prints(tmp_path, capsys):
    named = ["--controllers", "hysteresis", "PWM", "--decisions", "20"]
    assert timing.main(["--out", str(tmp_path), *named]) == 0
    rows = json.loads((tmp_path / "timing.json").read_text())
    assert [row["controller"] for row in rows] == ["hysteresis", "PWM"]
    assert (tmp_path / "timing.csv").exists()
    assert "worst_us" in capsys.readouterr().out


def test_wrong_input_is_refused(tmp_path):
    with pytest.raises(ValueError, match="no controller 'bang'"):
        timing.main(["--out", str(tmp_path), "--controllers", "bang"])
    with pytest.raises(SystemExit):
        timing.main(["--out", str(tmp_path), "--decisions", "0"])
