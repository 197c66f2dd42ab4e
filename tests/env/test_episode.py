"""An episode ends in an empty circuit or at its time limit; success is to settle and stay."""

from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest

from epv_env.plant.consumption import SCENARIOS
from epv_env.reward import EMPTY_CIRCUIT_BAR
from tests.env.rollouts import IDS, actions, native

CALM = {"scenario": "none", "supply": 10.0, "target_bar": 8.0, "p2_bar": 8.0}
SETTLED = 100
"""Control periods of 5 ms until the band has to hold."""


def drive(decide, periods=120, **options) -> Iterator[dict[str, Any]]:
    """Run one EPValve under decide(k, p2 - target [bar]); yields info after each period."""
    env: Any = gymnasium.make("EPValve-v0", **{**CALM, **options}).unwrapped
    env.reset(seed=2)
    error = 0.0
    for k in range(periods):
        info = env.step(decide(k, error))[-1]
        shown = env.snapshot()
        error = shown.p2_bar - shown.target_bar
        yield info | {"error": error}


def test_a_hard_application_empties_a_circuit_that_is_not_fed():
    hard = {"scenario": "emergency", "p2_bar": 1.6, "target_bar": 2.0}
    env: Any = gymnasium.make("EPValve-v0", **hard)
    env.reset(seed=0)
    empty, reward, info = False, 0.0, {}
    while not empty:
        _, reward, terminated, truncated, info = env.step(1)
        empty = env.unwrapped.snapshot().p2_bar <= EMPTY_CIRCUIT_BAR
        assert (terminated, truncated) == (empty, False)
        assert (info["reward_failure"] < 0) == empty
    assert reward < info["reward_failure"]
    assert info["consumption_g_per_s"] >= 4.0
    assert not info["is_success"]


@pytest.mark.parametrize("identifier", IDS)
@pytest.mark.parametrize("scenario", SCENARIOS)
def test_nothing_but_an_empty_circuit_terminates(identifier, scenario):
    env = native(identifier, 16, scenario=scenario, p3_bar=(1.0, 16.0), p2_bar=(1.6, 16.0))
    env.reset(seed=3)
    for command in actions(identifier, 16, 60):
        running = ~env._done
        terminated = env.step(command)[2]
        empty = env.task.valves.state.p2 <= EMPTY_CIRCUIT_BAR * 1e5
        np.testing.assert_array_equal(terminated[running], empty[running])


@pytest.mark.parametrize(("identifier", "limit"), [("EPValve-v0", 2000), ("EPValvePWM-v0", 500)])
def test_the_time_limit_truncates(identifier, limit):
    env = native(identifier, 2, **CALM)
    env.reset(seed=0)
    on = np.ones_like(actions(identifier, 2, 1)[0])
    steps = [env.step(on) for _ in range(limit)]
    assert not np.any([terminated for _, _, terminated, _, _ in steps])
    truncated = [truncated.tolist() for _, _, _, truncated, _ in steps]
    assert truncated == [[False, False]] * (limit - 1) + [[True, True]]
    assert steps[-1][-1]["is_success"].all()


def test_who_stays_in_the_band_succeeds_once_settled_and_who_leaves_it_then_fails():
    success = [info["is_success"] for info in drive(lambda k, error: 1)]
    assert success == [False] * SETTLED + [True] * 20
    infos = list(drive(lambda k, error: int(k < SETTLED + 5), p2_bar=8.3, periods=160))
    assert infos[SETTLED]["is_success"]
    assert infos[-1]["deviation_bar"] > 0.5
    assert not infos[-1]["is_success"]


def test_who_comes_back_has_failed_all_the_same():
    """A small circuit overflows quickly, and a leak brings it back into the band."""
    left = []

    def leave_once(k, error):
        if error > 0.5:
            left.append(k)
        return int(k < SETTLED or bool(left) or error > 0.6)

    runs = drive(leave_once, 1000, parameters={"V2": 3e-4}, scenario="leak", p2_bar=8.4)
    back = next(info for info in runs if left and info["error"] < 0.3)
    assert abs(back["deviation_bar"]) < 0.5
    assert not back["is_success"]


def test_a_new_episode_forgets_the_failure_of_the_last():
    env = gymnasium.make("EPValve-v0", **CALM).unwrapped
    for p2, expected in ((7.3, False), (8.0, True)):
        env.reset(seed=0, options={"p2_bar": p2})
        infos = [env.step(1)[-1] for _ in range(SETTLED + 2)]
        assert infos[-1]["is_success"] == expected


def test_deviation_is_the_largest_within_the_period():
    """A period of 100 ms tells what twenty periods of 5 ms told: p2 falls, then the valve opens.

    A circuit of a fifth of the volume makes the errors of integration five times as large.
    """
    leaking = {"scenario": "leak", "target_bar": 10.0, "p2_bar": 9.5, "parameters": {"V2": 2e-4}}
    coarse, fine = (
        list(drive(lambda k, error: 0, 1000 // n, control_period=n * 1e-3, **leaking)) for n in (100, 5)
    )
    for k, info in enumerate(coarse):
        parts = [part["deviation_bar"] for part in fine[20 * k : 20 * (k + 1)]]
        assert info["deviation_bar"] == pytest.approx(max(parts, key=abs), abs=2e-4)
    assert coarse[0]["deviation_bar"] < coarse[0]["error"] - 0.1
