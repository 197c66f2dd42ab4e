"""A failing sensor changes what it measures, and nothing else; p3's fault finds a controller warned."""

import numpy as np
import pytest

pytest.importorskip("pandas")

from controllers.policy import load_policy
from controllers.tuned import tuned
from epv_env.observation import decode
from training.evaluation.rollout import begin_episodes, make_env, run_episodes
from training.evaluation.scenarios import SENSOR_FAULTS
from training.evaluation.sensor_faults import BEGINS_S, CHANNELS, FAULTS, SensorFaults

PERIOD, EPISODES = 5e-3, 4
AFTER = round(BEGINS_S / PERIOD) + 40
ENTRIES = {"p1": ["p1"], "p3": ["p3", "p3_change_1", "p3_change_4"], "current": ["I"]}


@pytest.fixture(scope="module")
def observations():
    """Of an episode of a hysteresis, (periods, episodes, entries)."""
    controller = tuned("hysteresis")
    env = make_env(controller, EPISODES, threads=1)
    seen = [begin_episodes(env, controller, range(EPISODES))]
    for _ in range(AFTER):
        seen.append(env.advance(controller.act(seen[-1])).observation)
    return np.array(seen)


def read(observations, *faults):
    failing = SensorFaults(faults, EPISODES, PERIOD, np.random.default_rng(0))
    return np.array([failing.shown(seen) for seen in observations])


@pytest.mark.parametrize("channel", ENTRIES)
@pytest.mark.parametrize("fault", FAULTS[:-1])
def test_a_fault_changes_its_own_channel_from_its_instant_on(observations, channel, fault):
    shown = read(observations, (channel, fault))
    begins = round(BEGINS_S / PERIOD)
    assert np.array_equal(shown[:begins], observations[:begins])
    names = [*ENTRIES[channel], "p2_error", "target", "action", "since_switching", "p2_change_8"]
    others = [name for name in (*names, "p1", "p3", "I") if name not in ENTRIES[channel]]
    for name in others:
        np.testing.assert_allclose(decode(shown, name), decode(observations, name), atol=1e-5)
    before, after = (decode(each, ENTRIES[channel][0])[begins - 1 :] for each in (observations, shown))
    assert np.all(after[1:] == after[1]) == (fault in ("stuck", "zero", "saturated"))
    assert np.any(np.abs(after - before) > 1e-3)
    low, high = CHANNELS[channel].sensor.constants()[3:]
    assert fault == "zero" or np.all((after > low - 1e-3) & (after < high + 1e-3))


def test_swapped_sensors_show_each_other(observations):
    shown = read(observations, ("p1", "swapped"), ("p3", "swapped"))[AFTER]
    for name, other in (("p1", "p3"), ("p3", "p1")):
        np.testing.assert_allclose(decode(shown, name), decode(observations[AFTER], other), atol=1e-5)


def test_the_policy_mistrusts_a_wild_p3_as_soon_as_it_begins_and_no_sound_one():
    controller = load_policy()
    for faults, failed in (((), False), (SENSOR_FAULTS["p3 wild"].faults, True)):
        run_episodes(
            controller, seeds=range(16), duration=BEGINS_S + 0.2, options={"threads": 1}, faults=faults
        )
        assert np.all(controller.failed == failed)
        senses = controller.memory["senses"]
        assert np.all((senses["whole"] > senses["periods"]) != failed)  # sound: never a lost reading
