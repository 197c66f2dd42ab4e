"""The benchmarks' workloads run and count what they simulate."""

import pytest

from tests.benchmarks.interfaces import INTERFACES

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
