"""The benchmarks' workloads run, count what they simulate, and can be asked for by another process."""

import pytest

from tests.benchmarks import paired
from tests.benchmarks.interfaces import INTERFACES, actions
from tests.benchmarks.measure import Table

LEARNING = [name for name in INTERFACES if name.startswith(("PPO", "stable-baselines3"))]
SIMULATING = [name for name in INTERFACES if name not in LEARNING]
SHARE = 0.005
"""Of a workload's usual length."""


def valves(name):
    """Valves that an interface's name tells."""
    return next((n for n in (256, 1024) if f"{n} valves" in name), 1)


@pytest.mark.parametrize("name", SIMULATING)
def test_a_workload_counts_whole_periods_of_all_its_valves(name):
    run = INTERFACES[name].begin(SHARE)
    periods = run()
    assert periods > 0
    assert periods % valves(name) == 0
    assert run() == periods


@pytest.mark.training
@pytest.mark.parametrize("name", LEARNING)
def test_a_workload_of_learning_counts_whole_periods_of_all_its_valves(name):
    periods = INTERFACES[name].begin(SHARE)()
    assert periods > 0
    assert periods % valves(name) == 0


def test_every_ratio_is_to_a_kernel_with_as_many_valves():
    for name, interface in INTERFACES.items():
        if interface.kernel:
            assert interface.kernel.startswith("kernel")
            assert valves(interface.kernel) == valves(name)
            assert INTERFACES[interface.kernel].one_thread == interface.one_thread


def test_coils_are_switched_as_often_as_said():
    commands = actions(64, 500)
    assert set(commands.ravel().tolist()) == {0, 1}
    assert (commands[1:] != commands[:-1]).mean() == pytest.approx(0.15, abs=0.01)


def test_another_process_answers_with_rates():
    with paired.measuring(paired.ROOT) as process:
        rates = [paired.asked(process, "single environment", SHARE) for _ in range(2)]
    assert all(rate and rate > 0 for rate in rates)


def test_an_unknown_commit_is_refused_in_one_sentence():
    with pytest.raises(SystemExit, match=r"^commit 'no-such' cannot be checked out .*: give a commit"):
        paired.compare(Table(), "no-such", quick=True)
