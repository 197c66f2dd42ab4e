"""The critic's view is the truth, at the end of an episode too, and leaving the band is charged once."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
from stable_baselines3.common.vec_env import VecMonitor

from epv_env.common.units import BAR
from epv_env.observation import LAYOUT
from epv_env.sb3 import make_sb3_env
from training.learners.privileged_wrapper import FLOW, FORESIGHT, MECHANICS, PrivilegedWrapper

pytestmark = pytest.mark.training

N = 4
LENGTHS = [40, 60, 80, 100]
ENTRIES = len(LAYOUT)


def wrapped(charge=0.0, margin_bar=0.5, **options):
    env = make_sb3_env(
        "EPValve-v0", N, max_episode_steps=LENGTHS, privileged=True, scenario="steps",
        parameters="sensitive_ten_percent", **options,
    )  # fmt: skip
    return PrivilegedWrapper(
        VecMonitor(env), scale=1.0, charge=charge, margin_bar=margin_bar, longest=max(LENGTHS)
    )


def test_it_shows_the_true_state_also_where_an_episode_ends():
    env = wrapped()
    task = env.get_attr("task")[0]
    env.seed(1)
    env.reset()
    ends = 0
    for _ in range(120):
        shown, _, done, infos = env.step(np.ones(N, dtype=int))
        shown = np.asarray(shown)
        assert shown.shape == (N, ENTRIES + MECHANICS + 13 + len(FORESIGHT) - 1 + 2)
        np.testing.assert_allclose(
            shown[:, ENTRIES + 3], task.valves.state.p2 / (4 * BAR) - 2, atol=1e-5
        )
        for i in np.flatnonzero(done):
            last = infos[i]["terminal_observation"]
            true_p2 = infos[i]["true_state"][0]
            assert last[ENTRIES + 3] == pytest.approx(true_p2 / (4 * BAR) - 2, abs=1e-5)
            assert last[ENTRIES + 3] != pytest.approx(shown[i, ENTRIES + 3], abs=1e-3)
            ends += 1
    assert ends == sum(120 // length for length in LENGTHS)


def test_it_foresees_the_consumption():
    env = wrapped()
    inner: Any = env.unwrapped
    shown = np.asarray(env.reset())
    first = ENTRIES + MECHANICS + 13
    foreseen = shown[:, first : first + len(FORESIGHT) - 1] * FLOW
    flows = []
    for _ in range(32):
        env.step(np.ones(N, dtype=int))
        flows.append(inner.last_infos["consumption_g_per_s"].copy() * 1e-3)
    measured = np.array(flows)
    for k, (begin, end) in enumerate(pairwise(FORESIGHT[:6])):
        np.testing.assert_allclose(foreseen[:, k], measured[begin:end].mean(axis=0), atol=1e-9)


def test_an_episode_that_leaves_is_charged_once():
    """A valve that stays open fills the circuit far beyond the target."""
    rewards = []
    for charge in (0.0, 7.0):
        env = wrapped(charge=charge, settling_time=0.05)
        env.seed(3)
        env.reset()
        rewards.append([env.step(np.zeros(N, dtype=int))[1].copy() for _ in range(39)])
    charged = np.array(rewards[0]) - np.array(rewards[1])
    assert set(np.round(charged.sum(axis=0), 3)) == {7.0}
    assert np.all(charged[:9] == 0)  # not before the settling time


def test_an_episode_that_begins_far_below_leaves_only_once_it_has_arrived():
    """Shut, it never arrives and is not charged; open, it is charged as it rises beyond the band."""
    for action, charges in ((1, 0.0), (0, 7.0)):
        totals = []
        for charge in (0.0, 7.0):
            env = wrapped(charge=charge, settling_time=0.01, drop_bar=1.0)
            env.seed(3)
            env.reset()
            totals.append(sum(env.step(np.full(N, action))[1] for _ in range(39)))
        np.testing.assert_allclose(totals[0] - totals[1], charges, atol=1e-3)
