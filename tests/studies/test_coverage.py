"""The coverage study counts what lies in the regions, and its short form runs."""

import json

import numpy as np
import pytest

from docs.studies.coverage.study import coverage, main


def test_shares_are_those_of_known_distances():
    """Squared distances of chi-square's law: 95 % lie in the region, fewer if they are doubled."""
    distance = np.random.default_rng(0).chisquare(4, 2000)
    campaigns = [
        {
            "symbols": ["a", "b", "c", "d"], "distance": d, "independent": 2 * d, "disagreement": d,
            "inside": [True, True, True, False], "report_inside": [True] * 4, "report_joint": True,
        }
        for d in distance
    ]  # fmt: skip
    found = coverage(campaigns)
    assert found["joint region"]["low"] < 0.95 < found["joint region"]["high"]
    assert found["joint region if residuals were independent and inputs exact"]["high"] < 0.9
    assert found["interval of d"]["share"] == 0.0


@pytest.mark.slow
def test_the_short_form_writes_results_and_page(tmp_path):
    assert main(["--quick", "--out", str(tmp_path)]) == 0
    found = json.loads((tmp_path / "coverage.json").read_text(encoding="utf-8"))
    assert set(found) >= {"joint region", "interval of alphaMV"}
    assert "| joint region |" in (tmp_path / "README.md").read_text(encoding="utf-8")
