"""Thresholds: a block with Coulomb friction turns and sticks as events in scipy make it."""

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.identification.gap.ode_plants import block, quiet_run

K, FRICTION, END = 1.0, 0.13, 15.0


def swings(time) -> np.ndarray:
    """Positions of the block on its spring: solve_ivp from turn to turn, then it sticks.

    Between turns the motion is half a cosine about -FRICTION sign/K: it turns after pi/sqrt(K).
    """
    s, begin, sign, position = 1.0, 0.0, -1.0, np.empty(len(time))
    half = np.pi / np.sqrt(K)
    while True:
        inside = time >= begin
        if K * abs(s) <= FRICTION:
            position[inside] = s
            return position
        found = solve_ivp(
            lambda t, y, sign=sign: (y[1], -K * y[0] - FRICTION * sign),
            (begin, begin + half),
            (s, 0.0),
            rtol=1e-11,
            atol=1e-13,
            dense_output=True,
        )
        position[inside] = found.sol(np.minimum(time[inside], begin + half))[0]
        s, begin, sign = float(found.y[0, -1]), begin + half, -sign


@cache  # compiling a block takes seconds
def errors(steps: int, thresholds: bool, mode: str = "compiled") -> float:
    run = quiet_run(0.1, round(END / 0.1), pull=np.zeros(round(END / 0.1)))
    y = block([run], mode, steps, thresholds).outputs({"k": np.array([K])}, [0])[0][0, :, 0]
    return float(np.max(np.abs(y - swings(run.time))))


def test_turns_and_sticking_converge_to_those_of_scipy():
    coarse, fine = errors(1, True), errors(2, True)
    assert coarse < 5e-6
    assert coarse / fine == pytest.approx(16, rel=0.2)
    assert errors(1, False) > 100 * coarse


@pytest.mark.parametrize("mode", ["numpy", "python"])
def test_modes_without_numba_locate_thresholds_too(mode):
    assert errors(1, True, mode) == pytest.approx(errors(1, True), rel=1e-3, abs=1e-9)


def test_a_pulled_block_sticks_and_slips():
    time = 0.1 * np.arange(100)
    pull = np.where(time < 3.0, 1.0 + 0.9 * FRICTION, 1.0 + 2.0 * FRICTION)
    position = block([quiet_run(0.1, 100, pull=pull)]).outputs({"k": np.array([K])}, [0])[0][0, :, 0]
    np.testing.assert_allclose(position[time <= 3.0], 1.0, atol=1e-6)
    since = np.clip(time[30:] - time[30], 0.0, np.pi)
    slip = 1.0 + FRICTION * (1.0 - np.cos(since))  # equilibrium 1 + friction, turns after half a period
    np.testing.assert_allclose(position[30:], slip, atol=1e-5)
