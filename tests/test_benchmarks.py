"""The benchmarks: the relief valve's integrators agree; workloads count what they simulate."""

import numpy as np
import pytest

from tests.benchmarks.interfaces import INTERFACES
from tests.benchmarks.relief_device import run_device, trajectories
from tests.benchmarks.relief_peers import NoOdeintError, build, run_odeint, run_scipy
from tests.benchmarks.relief_valve import Result, Task, run_lanes
from tests.env.test_device import compiles, simulated

TASK = Task(flows=np.array([0.5, 2.0, 5.0, 7.0, 9.0]), transient=3, recorded=3)


@pytest.fixture(scope="module")
def true():
    """SciPy at a tight tolerance."""
    return run_scipy(TASK, "DOP853", 1e-12)[0]


def test_impacts_and_maxima_agree_with_scipy(true):
    """Impact times and maxima agree to 1e-8, with as many impacts in each trajectory."""
    assert np.isfinite(true.impacts).any(axis=1).tolist() == [True, True, True, True, False]
    found, _ = run_lanes(TASK, 2.5e-3)
    assert found.error(true) < 1e-8
    assert found.passed.tolist() == true.passed.tolist()


def test_a_simulated_device_finds_what_the_lanes_find(tmp_path):
    ((found, _), _) = simulated(tmp_path, run_device, [{"task": TASK, "step": 1e-2}])[0]
    assert found.error(run_lanes(TASK, 1e-2)[0]) < 1e-9


def test_the_kernel_compiles_for_an_accelerator(monkeypatch):
    found = Result.empty(TASK)
    arguments = (TASK.flows, 1e-2, TASK.transient, found.impacts, found.maxima, found.passed)
    assert compiles(trajectories, arguments, monkeypatch)


def test_error_falls_with_the_fourth_power_of_the_step(true):
    """Located impacts keep the order of the Runge-Kutta method."""
    coarse, fine = (run_lanes(TASK, step)[0].error(true) for step in (2e-2, 5e-3))
    assert 3.5 < np.log(coarse / fine) / np.log(4.0) < 5.5


def test_a_wrong_rebound_is_noticed(true, monkeypatch):
    """The comparison can fail: SciPy with another restitution differs."""
    monkeypatch.setattr("tests.benchmarks.relief_peers.RESTITUTION", 0.79)
    assert run_scipy(TASK, "RK45", 1e-6)[0].error(true) > 1e-3


def test_a_resting_valve_ends_early():
    """At a large flow the oscillation dies: the trajectory ends at the equilibrium."""
    found, _ = run_lanes(Task(flows=np.array([10.0])), 2.5e-3)
    x = found.maxima[0, -1]
    assert found.passed[0] < 1024
    assert x * np.sqrt(x + 10.0) == pytest.approx(10.0, abs=1e-8)


def test_odeint_agrees_with_scipy(true, tmp_path):
    """Boost odeint, where it is installed, does the same task."""
    try:
        program = build(tmp_path)
    except NoOdeintError as missing:
        pytest.skip(str(missing))
    found, seconds = run_odeint(program, TASK, 1e-10)
    assert found.error(true) < 1e-7
    assert seconds > 0.0


SHARE = 0.005
"""Of a workload's usual length."""


@pytest.mark.training
def test_a_workload_counts_whole_periods_of_all_its_valves():
    pytest.importorskip("stable_baselines3")
    for name, interface in INTERFACES.items():
        valves = next((n for n in (256, 1024) if f"{n} valves" in name), 1)
        run = interface.begin(SHARE)
        periods = run()
        assert periods > 0, name
        assert periods % valves == 0, name
        assert run() == periods, name
        assert interface.kernel is None or interface.kernel in INTERFACES
