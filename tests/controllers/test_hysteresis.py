"""The two-point controller does what its thresholds say."""

import numpy as np
import pytest

from controllers.hysteresis import Hysteresis
from epv_env.observation import LAYOUT, encode


def observe(error, change=0.0):
    """Observations (n, entries) with a given error [bar] and change of p2 over 4 periods [bar]."""
    error = np.atleast_1d(np.asarray(error, float))
    values = {quantity.name: np.full_like(error, quantity.centre) for quantity in LAYOUT}
    return encode({**values, "p2_error": error, "p2_change_4": np.broadcast_to(change, error.shape)})


def test_opens_below_shuts_above_and_remembers_between():
    controller = Hysteresis(open_below=-0.2, shut_above=0.1)
    controller.reset(1)
    actions = [int(controller.act(observe(e))[0]) for e in (0.0, -0.3, 0.0, 0.05, 0.2, 0.0)]
    assert actions == [1, 0, 0, 0, 1, 1]


def test_extrapolation_acts_before_the_threshold_is_reached():
    rising = observe(0.0, change=0.4)  # 0.4 bar in 20 ms: 20 bar/s
    plain, looking = (
        Hysteresis(open_below=-0.2, shut_above=0.1, shut_lookahead=lead) for lead in (0.0, 0.01)
    )
    for controller in (plain, looking):
        controller.reset(1)
        controller.act(observe(-0.5))
    assert plain.act(rising)[0] == 0
    assert looking.act(rising)[0] == 1


def test_each_valve_of_a_batch_has_its_own_memory():
    controller = Hysteresis(open_below=-0.2, shut_above=0.1)
    controller.reset(2)
    controller.act(observe([-0.3, 0.0]))
    assert controller.act(observe([0.0, 0.0])).tolist() == [0, 1]


def test_contradictory_thresholds_are_refused():
    with pytest.raises(ValueError, match="open_below <= shut_above"):
        Hysteresis(open_below=0.2, shut_above=0.1)
    with pytest.raises(ValueError, match="lag = 3"):
        Hysteresis(open_below=-0.2, shut_above=0.1, lag=3)
