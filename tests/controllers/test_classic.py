"""The classic controllers: thresholds do what they say; the PWM's design is that of the plant."""

from typing import Any

import numpy as np
import pytest

pytest.importorskip("control")


from controllers.hysteresis import Hysteresis
from controllers.pwm_design import design, linearise, outer_loop
from epv_env.observation import LAYOUT, encode
from epv_env.plant.equations import Inputs
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves

pytestmark = pytest.mark.training

P1, P2, PERIOD = 11.5e5, 8e5, 20e-3
SHAPE: dict[str, Any] = {
    "p1": P1, "p2": P2, "inner_time": 0.02, "phase_margin": 40.0, "integral_time": 1.0, "period": PERIOD,
}  # fmt: skip


@pytest.fixture(scope="module")
def plant():
    return Parameters.calibrated()


def test_the_operating_duty_nearly_holds_p3_in_the_full_simulation(plant):
    """Switched with the design's duty, the simulated valve's p3 settles near the operating point."""
    point = linearise(plant, p1=P1, p2=P2)
    assert point.a < 0 < point.b  # an open valve raises p2, and p3 drifts back
    assert point.g < 0 < point.duty < 1
    duty = design(plant, **SHAPE).duty
    valves = Valves.started(1, plant, energised(plant, p1=P1, p2=P2, U=24.0), threads=1)
    valves.state.p3[:] = point.p3
    mean = []
    for _ in range(60):
        inside = []
        for on, share in ((24.0, duty), (0.0, 1 - duty)):
            for value, field in zip(Inputs(on, 0.0, 0.0, 0.0), valves.inputs, strict=True):
                field[:] = value
            valves.advance(share * PERIOD)
            inside.append(float(valves.state.p3[0]))
        valves.state.p2[:] = P2  # the circuit is held: only the control chamber is looked at
        mean.append(np.mean(inside))
    assert np.mean(mean[-10:]) == pytest.approx(point.p3, rel=0.15)


def test_margins_are_those_of_the_loop_at_its_crossover(plant):
    found = design(plant, **SHAPE)
    point = linearise(plant, p1=P1, p2=P2)
    z = np.exp(1j * np.array([found.crossover]) * PERIOD)
    at_crossover = found.outer_gain * outer_loop(point, found.inner_gain, 1.0, PERIOD, z)[0]
    assert abs(at_crossover) == pytest.approx(1.0, rel=0.01)
    assert 180 + np.degrees(np.angle(at_crossover)) == pytest.approx(found.phase_margin, abs=0.5)
    assert found.phase_margin >= 40.0
    assert found.gain_margin > 1


def test_an_impossible_margin_is_refused(plant):
    with pytest.raises(ValueError, match="no gain keeps a phase margin"):
        design(plant, **SHAPE | {"phase_margin": 85.0, "integral_time": 0.05})


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
