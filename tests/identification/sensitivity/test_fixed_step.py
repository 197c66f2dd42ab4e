"""The fixed step solves the plant's equations, and scatters where the armature is involved."""

from functools import cache

import numpy as np
import pytest

from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import SimulationError, energised, simulate
from identification.report_2003.cases import CALIBRATION_CASES
from identification.sensitivity.fixed_step import simulate_fixed_step
from tests.identification.sensitivity.study import one_at_a_time

ARMATURE = ("mMV", "kMV", "xMVmax")
NO_ARMATURE = ("V2", "alphaPV", "a1", "alphaMV", "V3")


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


def test_strokes_stay_within_the_stops():
    p = Parameters.nominal()
    U = CALIBRATION_CASES[0].voltage(18.9, 2000)
    start = energised(p, p1=12.5e5, p2=6.8e5, U=18.9)
    state = simulate_fixed_step(p, initial=start, U=U, period=5e-4).state
    for x, top in ((state.xPV, p["xPVmax"]), (state.xMV, p["xMVmax"])):
        assert np.min(x) == 0.0
        assert np.max(x) == top


@pytest.mark.parametrize("symbol", ARMATURE)
def test_its_scatter_lifts_the_armature_s_rows_to_the_report_s_size(symbol):
    exact, scatter = one_at_a_time().exact[symbol], one_at_a_time().scatter[symbol]
    assert np.median(scatter[:, 0]) > 1.5 * exact.minus
    assert np.median(scatter[:, 1]) > 1.5 * exact.plus


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
