"""The report's tables come back, and the count can tell when they do not; its figures are checked."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from docs.studies.reproduction import study
from docs.studies.reproduction.errata import (
    ERRATUM,
    HOLDS,
    figure_checks,
    recomputed_total,
    signal_to_noise,
)
from docs.studies.reproduction.fixed_step import simulate_fixed_step
from docs.studies.reproduction.sensitivity_tables import (
    OneAtATime,
    agreement_with_printed,
    run_one_at_a_time,
)
from docs.studies.reproduction.study import FOLDER, page_parts
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised, simulate
from identification.recordings.recording import CHANNELS
from identification.report_2003 import CALIBRATION_CASES


@cache
def one_at_a_time() -> OneAtATime:
    return run_one_at_a_time()


@pytest.mark.slow
def test_the_fixed_step_reproduces_tables_8_and_9():
    met = agreement_with_printed(one_at_a_time().fixed_step)
    assert met.figures == 46
    assert met.reproduced >= 36
    assert met.classes_differ == ()
    assert met.worst_factor < 2.0


@pytest.mark.slow
def test_the_short_form_gives_the_published_tables(tmp_path, monkeypatch):
    """All that does not depend on the number of searches is equal; the estimates agree."""
    published = json.loads((study.FOLDER / "reproduce.json").read_text(encoding="utf-8"))
    monkeypatch.setattr(study, "run_one_at_a_time", one_at_a_time)
    assert study.main(["--quick", "--out", str(tmp_path)]) == 0
    found = json.loads((tmp_path / "reproduce.json").read_text(encoding="utf-8"))
    for name in ("table8", "table9", "comparison"):
        assert found[name].keys() == published[name].keys()
    for symbol, row in published["table8"].items():
        assert found["table8"][symbol] == pytest.approx(row, rel=1e-6)
    assert found["slips"] == published["slips"]
    for method, values in published["virtual_bench"]["table12"].items():
        assert found["virtual_bench"]["table12"][method] == pytest.approx(values, rel=1e-4)
    assert {path.name for path in tmp_path.glob("*.png")} == {"calibration.png"}


@pytest.mark.slow
def test_another_class_is_noticed():
    rows = dict(one_at_a_time().fixed_step)
    rows["d1"] = replace(rows["d1"], minus=0.001, plus=0.001)
    met = agreement_with_printed(rows)
    assert met.classes_differ == ("d1",)
    assert met.worst_factor > 100
    assert met.reproduced == agreement_with_printed(one_at_a_time().fixed_step).reproduced - 2


@cache
def deviation(step: float) -> float:
    """Root mean square of p3 against the exact integrator [Pa], sampled each millisecond."""
    p = Parameters.nominal()
    start = energised(p, p1=12.5e5, p2=6.8e5, U=18.9)
    every = round(1e-3 / step)
    U = CALIBRATION_CASES[0].voltage(18.9, 1 / step)
    fine = simulate_fixed_step(p, initial=start, U=U, period=step).state.p3[::every, 0]
    exact = simulate(p, initial=start, U=U[::every], period=1e-3).state.p3
    return float(np.sqrt(np.mean((fine - exact) ** 2)))


@pytest.mark.slow
def test_it_converges_to_the_exact_integrator():
    assert deviation(1e-5) < 50.0
    assert deviation(1e-5) < 0.1 * deviation(5e-4)


STATUS = {check.where: check.status for check in figure_checks()}
PUBLISHED = json.loads((FOLDER / "reproduce.json").read_text(encoding="utf-8"))


def test_the_page_shows_the_published_results():
    page = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert all(part in page for part in page_parts(PUBLISHED).values())


def test_total_error_of_table_13_is_not_what_eq_21_gives():
    assert recomputed_total(13) == pytest.approx(6.8297, abs=1e-4)
    assert STATUS["Table 13, total error [%]"] == ERRATUM
    assert STATUS["Table 11, total error [%]"] == HOLDS


def test_only_p2_s_signal_to_noise_ratio_follows_from_its_standard_deviation():
    fits = [name for name in CHANNELS if STATUS[f"Table 3, SNR of {name} [dB]"] == HOLDS]
    assert fits == ["p2"]
    assert signal_to_noise("p2", 0.0098) == pytest.approx(64.26, abs=0.01)


def test_seven_of_ten_pairs_are_correlated():
    (found,) = [check for check in figure_checks() if "non-correlated" in check.where]
    assert found.recomputed.startswith("7 of 10 pairs beyond ±0.0196")
