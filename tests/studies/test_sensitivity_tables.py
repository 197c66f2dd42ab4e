"""Tables 8 and 9 come back with the fixed step, and the count can tell when they do not."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from docs.studies.reproduction import study
from docs.studies.reproduction.fixed_step import simulate_fixed_step
from docs.studies.reproduction.sensitivity_tables import (
    OneAtATime,
    agreement_with_printed,
    run_one_at_a_time,
)
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import SimulationError, energised, simulate
from identification.report_2003 import CALIBRATION_CASES

pytestmark = pytest.mark.slow

NO_ARMATURE = ("V2", "alphaPV", "a1", "alphaMV", "V3")


@cache
def one_at_a_time() -> OneAtATime:
    return run_one_at_a_time()


def test_the_fixed_step_reproduces_tables_8_and_9():
    met = agreement_with_printed(one_at_a_time().fixed_step)
    assert met.figures == 46
    assert met.reproduced >= 36
    assert met.classes_differ == ()
    assert met.worst_factor < 2.0


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
    for method, values in published["virtual_bench"]["table12"].items():
        assert found["virtual_bench"]["table12"][method] == pytest.approx(values, rel=1e-4)
    assert {path.name for path in tmp_path.glob("*.png")} == {"calibration.png"}


def test_exact_stops_reproduce_fewer():
    met = agreement_with_printed(one_at_a_time().exact)
    assert met.reproduced >= 33
    assert met.classes_differ == ("RML",)


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


def test_it_converges_to_the_exact_integrator():
    assert deviation(1e-5) < 50.0
    assert deviation(1e-5) < 0.1 * deviation(5e-4)


@pytest.mark.parametrize("symbol", NO_ARMATURE)
def test_rows_that_leave_the_armature_alone_carry_no_scatter(symbol):
    """No pressure acts on the armature, so its scatter is the same in both runs and cancels."""
    scatter = one_at_a_time().scatter[symbol]
    assert np.ptp(scatter, axis=0).max() < 0.03 * scatter.mean()


def test_a_step_that_is_too_long_is_refused():
    p = Parameters.nominal().replace(kMV=10.0, mMV=0.001)
    start = energised(p, p1=12.5e5, p2=6.8e5, U=18.9)
    with np.errstate(all="ignore"), pytest.raises(SimulationError, match="shorter"):
        simulate_fixed_step(p, initial=start, U=np.tile([0.0, 18.9], 200), period=5e-2)
