"""The adaptive cascade: its feed-forward is the piston's balance, its prediction the simulated p3."""

from typing import Any

import numpy as np
import pytest

pytest.importorskip("control")

from controllers.adaptive_cascade import build
from controllers.opening_pressure import opening_pressure
from epv_env.common.units import BAR
from epv_env.observation import LAYOUT, encode
from epv_env.plant.coefficients import coefficients
from epv_env.plant.equations import Coefficients, flow_PV, piston_force
from epv_env.plant.plantfile import Plant
from epv_env.plant.simulate import energised, simulate
from training.evaluation.rollout import run_episodes

pytestmark = pytest.mark.training
PLANT = Plant.calibrated()
P = PLANT.parameters
SETTINGS: dict[str, Any] = {
    "outer_time": 0.04, "integral_time": 1.0, "setpoint": 0.0, "idle": 0.4, "depth": 0.6,
    "rest_above": 0.4, "reluctance": 0.1, "filter_time": 0.0125,
}  # fmt: skip


@pytest.fixture(scope="module")
def cascade():
    return build(SETTINGS, PLANT)


@pytest.mark.parametrize("depth", [0.05, 0.3])
def test_the_feed_forward_balances_the_piston_and_gives_the_flow_asked_for(cascade, depth):
    p1, p2 = 11.5, 8.0
    c = Coefficients(*coefficients(P)[:, 0].tolist())
    opening = opening_pressure(P, np.array(p1 * BAR), np.array(p2 * BAR)) / BAR
    still = energised(P, p1=p1 * BAR, p2=p2 * BAR, U=24.0)
    stroke = depth * BAR * c.piston_area / c.cPV
    state = still._replace(p3=(opening - depth) * BAR, xPV=stroke)
    assert piston_force.py_func(state, c, None, False) == pytest.approx(0.0, abs=1e-6)
    rate = c.RT_V2 * flow_PV.py_func(state, c, None, False) / BAR
    foreseen = depth * cascade.flow_per_depth(np.array([p1]), np.array([p2]))
    assert foreseen[0] == pytest.approx(rate, rel=1e-3)


STEP = 0.1e-3


def p3_over(times_on: list[tuple[float, bool]]) -> np.ndarray:
    """Simulated p3 [bar] at each STEP while the coil is on or off for the given times [s], from rest."""
    U = np.concatenate([np.full(round(time / STEP), 24.0 * on) for time, on in times_on])
    start = energised(P, p1=11.5 * BAR, p2=8.0 * BAR, U=24.0)
    return np.asarray(simulate(P, initial=start, U=U, period=STEP).state.p3) / BAR


def test_the_lag_of_pulling_in_is_the_simulated_one(cascade):
    """p3 falls until the armature has pulled in and rises then: where both lines meet."""
    p3 = p3_over([(40e-3, False), (20e-3, True)])
    switched, slope = round(40e-3 / STEP), 10
    falls = (p3[switched] - p3[switched - slope]) / slope
    late = switched + round(12e-3 / STEP)
    rises = (p3[late] - p3[late - slope]) / slope
    meet = (p3[switched] - p3[late] + rises * (late - switched)) / (rises - falls) * STEP
    assert cascade.pull_in_lag == pytest.approx(meet, abs=0.7e-3)


def foreseen(cascade, p3: float, on: bool, since: float) -> tuple[float, float]:
    """What the cascade foresees of a nominal valve at this p3 [bar], under off and under on [bar]."""
    values = dict.fromkeys((quantity.name for quantity in LAYOUT), 0.0) | {
        "target": 8.0, "p1": 11.5, "p3": p3, "action": float(on), "since_switching": since,
    }  # fmt: skip
    cascade.reset(1)
    observation = encode({name: np.array([value]) for name, value in values.items()})
    valve = cascade._learner.observe(observation)
    off_end, on_end = cascade.foreseen(valve, np.array([since]))
    return float(off_end[0]), float(on_end[0])


@pytest.mark.parametrize("on", [False, True])
def test_the_servo_foresees_p3_of_the_simulation_when_the_next_action_can_act(cascade, on):
    """After 40 ms of venting the coil stays off, or is switched on."""
    period = cascade.control_period
    p3 = p3_over([(40e-3, False), (20e-3, on)])
    now = p3[round(40e-3 / STEP) - 1]
    later = 40e-3 + period + (cascade.table.release_lag if on else cascade.pull_in_lag)
    expected = foreseen(cascade, now, False, 40e-3)[on]
    assert expected == pytest.approx(p3[round(later / STEP) - 1], abs=0.06)
    assert (expected > now) == on


def test_a_control_pressure_kept_ready_answers_an_emergency_sooner_than_a_rested_one():
    """The same controller, once always at work and once at rest above the target."""

    def breakdown(**changes):
        metrics, _ = run_episodes(
            build({**SETTINGS, **changes}, PLANT), seeds=list(range(8)), duration=5.0,
            options={"scenario": "emergency", "drop_bar": (0.0, 0.2)},
        )  # fmt: skip
        return metrics.event_breakdown_bar.mean()

    assert breakdown() < 0.5 * breakdown(rest_above=0.0)
