"""The memory of breakdowns: what counts, and how it fades."""

import numpy as np
import pytest

from controllers.breakdown_memory import BreakdownMemory

FED = np.ones(1, dtype=bool)


def memory(memory_time: float = 60.0) -> BreakdownMemory:
    """Of one circuit."""
    remembered = BreakdownMemory(memory_time=memory_time, control_period=5e-3)
    remembered.reset(1)
    return remembered


def deepest(remembered: BreakdownMemory, *errors: float, fed: np.ndarray = FED) -> float:
    """After these readings of p2 - target [bar]."""
    found = [remembered.observe(np.array([error]), fed) for error in errors]
    return float(found[-1][0])


def test_the_way_up_to_the_target_is_no_breakdown():
    remembered = memory()
    assert deepest(remembered, -4.0, -0.4, -0.1) == 0.0
    assert deepest(remembered, -0.04, -0.3) == pytest.approx(0.3)


def test_the_largest_shortfall_is_kept_and_fades():
    assert deepest(memory(), 0.0, -0.4, -0.1, 0.2) == pytest.approx(0.4, rel=1e-3)
    assert deepest(memory(memory_time=1.0), 0.0, -0.4, *[0.0] * 200) == pytest.approx(0.4 / np.e)


def test_a_shortfall_counts_as_that_of_the_band_at_most():
    assert deepest(memory(), 0.0, -3.0) == 0.5


def test_what_a_missing_supply_causes_does_not_count():
    remembered = memory()
    deepest(remembered, 0.0)
    assert deepest(remembered, -0.4, fed=~FED) == 0.0
    assert deepest(remembered, -0.3) == 0.0  # on the way up


def test_circuits_are_forgotten_one_by_one():
    remembered = BreakdownMemory(memory_time=60.0, control_period=5e-3)
    remembered.reset(2)
    fed = np.ones(2, dtype=bool)
    remembered.observe(np.zeros(2), fed)
    remembered.observe(np.array([-0.3, -0.4]), fed)
    remembered.forget(np.array([0]))
    found = remembered.observe(np.array([-0.2, -0.2]), fed)
    assert found[0] == 0.0
    assert found[1] == pytest.approx(0.4, rel=1e-3)
