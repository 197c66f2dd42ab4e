"""The studies of controllers in their short form: result files, pictures, and the page's tables."""

import pandas as pd
import pytest

pytest.importorskip("stable_baselines3")

from docs.studies.common import PAGE
from docs.studies.comparison import study as comparison
from docs.studies.robustness import study as robustness
from docs.studies.sim_to_real import study as sim_to_real

pytestmark = [pytest.mark.training, pytest.mark.slow]


def test_the_comparison(tmp_path, monkeypatch):
    monkeypatch.setattr(comparison, "CONTROLLERS", ("pulse, adaptive", "hysteresis, extrapolating"))
    assert comparison.main(["--quick", "--out", str(tmp_path)]) == 0
    names = {"comparison.csv", "differences.csv", "beyond.csv", "comparison.png", PAGE}
    assert names <= {path.name for path in tmp_path.iterdir()}
    assert "| hysteresis, extrapolating |" in (tmp_path / PAGE).read_text(encoding="utf-8")
    assert "restart" in set(pd.read_csv(tmp_path / "beyond.csv")["scenario"])


def test_the_sweep(tmp_path, monkeypatch):
    monkeypatch.setattr(robustness, "CONTROLLERS", ("hysteresis, extrapolating",))
    assert robustness.main(["--quick", "--out", str(tmp_path)]) == 0
    text = (tmp_path / PAGE).read_text(encoding="utf-8")
    assert "| 13 parameters ±10 % | hysteresis, extrapolating |" in text
    assert (tmp_path / "robustness-conditions.png").exists()


def test_the_loop(tmp_path):
    assert sim_to_real.main(["--quick", "--out", str(tmp_path)]) == 0
    text = (tmp_path / PAGE).read_text(encoding="utf-8")
    assert "Withheld: pressure_sensor_lag" in text
    assert "| PPO | after |" in text
