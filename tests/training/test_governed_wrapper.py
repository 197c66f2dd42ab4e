"""Under a governor a policy learns in the environment that a supervisor acts in."""

from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
from stable_baselines3.common.vec_env import VecMonitor

from controllers.governor import Governor
from controllers.pulse_simulation import nominal_table
from controllers.supervisor import Supervisor
from controllers.supervisor_settings import SupervisorSettings
from epv_env.observation import INDEX, LAYOUT, decode
from epv_env.plant.plantfile import Plant
from epv_env.sb3 import make_sb3_env
from training.learners.governed_wrapper import GovernedWrapper

pytestmark = pytest.mark.training

N = 6
PLANT = Plant.calibrated()
TABLE = nominal_table(PLANT)
SETTINGS = SupervisorSettings(tolerated=0.2)
"""Most valves need a reserve."""


def episodes(lengths: Any = 300) -> VecMonitor:
    env = make_sb3_env(
        "EPValve-v0", N, max_episode_steps=lengths, privileged=True, plant=PLANT, scenario="mixed",
        parameters="sensitive_ten_percent",
    )  # fmt: skip
    env.seed(5)
    return VecMonitor(env)


def governed(lengths: Any = 300) -> GovernedWrapper:
    return GovernedWrapper(episodes(lengths), Governor(TABLE, SETTINGS, control_period=5e-3))


class Opens:
    """Switches off below a p2 a little above the target, whatever else there is."""

    name = "opens"
    environment = "EPValve-v0"

    def reset(self, n: int) -> None:
        pass

    def act(self, observations):
        return (decode(observations, "p2_error") > 0.03).astype(int)


def test_the_episodes_are_those_of_a_supervised_controller():
    """The controller in the wrapper, and the supervisor around it in the bare environment."""
    control = Supervisor(main=Opens(), table=TABLE, settings=SETTINGS)
    bare, under = episodes(), governed()
    control.reset(N)
    seen: Any = bare.reset()
    shown: Any = under.reset()
    overruled = 0
    for _ in range(250):
        asked = Opens().act(shown)
        overruled += np.sum(under.must_shut & (asked == 0))
        seen, reward, _, _ = bare.step(control.act(seen))
        shown, mine, _, _ = under.step(asked)
        np.testing.assert_array_equal(mine, reward)
    assert overruled > 20  # the governor had something to say
    assert np.any(under.shift > 0)


def test_an_episode_that_ends_leaves_nothing_to_the_next_one():
    """Episodes of one length begin anew together, as from a reset."""
    one = governed(40)
    one.reset()
    for _ in range(39):
        one.step(np.zeros(N, dtype=int))
    observation, _, done, _ = one.step(np.zeros(N, dtype=int))
    assert np.all(done)
    fresh = Governor(TABLE, SETTINGS, control_period=5e-3)
    fresh.reset(N)
    shown = np.asarray(observation)
    unshifted = shown.copy()
    row = INDEX["p2_error"]
    unshifted[:, row] += (one.shift / LAYOUT[row].scale).astype(shown.dtype)
    np.testing.assert_allclose(fresh.advise(unshifted).shift, one.shift, atol=1e-6)
    for (name, mine, own), (_, its, other) in zip(one.governor.arrays(), fresh.arrays(), strict=True):
        np.testing.assert_allclose(getattr(mine, own), getattr(its, other), atol=1e-5, err_msg=name)


def test_the_last_observation_is_shown_with_the_last_shift():
    one, bare = governed(40), episodes(40)
    one.reset()
    bare.reset()
    actions = np.ones(N, dtype=int)
    for _ in range(39):
        one.step(actions)
        bare.step(actions)
    shift = one.shift.copy()
    *_, infos = one.step(actions)
    *_, plain = bare.step(actions)
    for i in range(N):
        mine, its = (each[i]["terminal_observation"][None] for each in (infos, plain))
        lower = decode(its, "p2_error") - decode(mine, "p2_error")
        assert lower == pytest.approx(shift[i], abs=1e-5)
