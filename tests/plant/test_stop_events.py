"""Why the plant locates its stops: a library's integrator that is not told of them ends elsewhere."""

import pytest

from epv_env.common.units import BAR
from identification.bench.reference_simulation import simulate_reference
from tests.benchmarks.eventless_integrators import STROKES, final_p2
from tests.benchmarks.workloads import CALIBRATED
from tests.reference.schedule import plant_states, report_tests


def test_an_integrator_without_stop_events_is_wrong_and_the_plant_is_not():
    schedule = report_tests(CALIBRATED)["test4"]
    end = [schedule.duration]
    true = simulate_reference(schedule, end, rtol=1e-9).state.p2[0]
    unaware, failure = final_p2(schedule, "LSODA", STROKES)
    assert not failure
    assert abs(unaware - true) > 0.1 * BAR
    assert plant_states(schedule, end).p2[0] == pytest.approx(true, abs=1e-4 * BAR)
