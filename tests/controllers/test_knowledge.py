"""The rules in front of a policy one by one, and the learnt quantities as observations for learners."""

import gymnasium
import numpy as np
import pytest

from controllers.knowledge import (
    INPUTS,
    LearntObservation,
    ValveKnowledge,
    above_band,
    below_band,
    cannot_raise,
    forced,
    with_rules,
    would_rise_too_far,
)
from controllers.pulse import AdaptivePulse
from controllers.tuned import tuned
from controllers.valve_learner import VALVE
from epv_env.observation import ENTRIES, LAYOUT, encode
from epv_env.plant.plantfile import Plant
from training.evaluation.rollout import run_episodes

pytestmark = pytest.mark.training
PLANT = Plant.calibrated()


def valve(**known: float):
    """A record of a valve of which only this is known."""
    record = np.zeros(1, VALVE)[0]
    for name, value in known.items():
        record[name] = value
    return record


def test_rules_hold_where_they_should_and_nowhere_else():
    """A supply that cannot raise p2; an early opening that would raise it too far; shields 3 to 5."""
    assert cannot_raise(valve(head=0.1))
    assert not cannot_raise(valve(head=1.0))
    assert would_rise_too_far(valve(error=0.0, after_period_early=0.25))
    for known in ({"error": -0.1}, {"fall": -1.0}, {"error": 0.4, "after_period_early": 0.0}):
        assert not would_rise_too_far(valve(**{"error": 0.0, "after_period_early": 0.25} | known))
    full = {"on": 1.0, "head": 1.0, "p1": 9.0, "p3": 8.5}
    assert above_band(0.5)
    assert not above_band(np.nextafter(0.5, 0))
    assert below_band(valve(**full), -0.5)
    assert not below_band(valve(**full), -0.49)
    for change in ({"on": 0.0}, {"head": 0.9}, {"p3": 8.4}):  # a pulse, a low supply, one under way
        assert not below_band(valve(**full | change), -0.5)
    assert forced(valve(**full), -0.5) == -1
    assert forced(valve(**full, found_open=1.0), -0.5) == 2


class Off:
    """Never switches the coil on."""

    name = "off"
    environment = "EPValve-v0"

    def reset(self, n: int) -> None:
        self.n = n

    def act(self, observations):
        return np.zeros(len(observations), int)


def seen(**values):
    usual = {quantity.name: np.full(1, quantity.centre) for quantity in LAYOUT}
    return encode(usual | {name: np.full(1, value) for name, value in values.items()})


def test_a_rule_overrules_the_controller_and_only_then():
    ruled = with_rules(Off(), PLANT)
    assert ruled.name == "off with rules"
    ruled.reset(1)
    assert ruled.act(seen(p1=8.1, target=8.0, p2_error=0.0, p3=8.1, action=1.0))[0] == 1
    ruled.reset(1)
    assert ruled.act(seen(p1=11.0, target=8.0, p2_error=-0.4, p3=11.0, action=1.0))[0] == 0


def test_rules_keep_a_careless_controller_from_the_upper_edge():
    options = {"parameters": "sensitive_ten_percent", "scenario": "none"}
    bare, ruled = (
        run_episodes(each, seeds=list(range(8)), duration=1.5, options=options)
        for each in (Off(), with_rules(Off(), PLANT))
    )
    assert bare.excursion_bar.min() > 0.5
    assert ruled.excursion_bar.max() < 0.6


def test_other_actions_are_refused():
    with pytest.raises(ValueError, match="rules keep the coil on"):
        with_rules(tuned("PWM"), PLANT)


def observing(mode: str, n: int = 4, **options):
    env = gymnasium.make_vec(
        "EPValve-v0", num_envs=n, vectorization_mode="vector_entry_point", autoreset_mode=mode,
        parameters="sensitive_ten_percent", threads=1, **options,
    )  # fmt: skip
    return LearntObservation(env)


def actions(n: int, periods: int) -> np.ndarray:
    """Pulses of random lengths."""
    rng = np.random.default_rng(0)
    return np.where(rng.random((periods, n)) < 0.1, 0, 1)


def test_a_wrapped_environment_shows_what_a_controller_knows():
    env = observing("Disabled", max_episode_steps=None)
    assert env.single_observation_space.shape == (INPUTS,)
    knowledge = ValveKnowledge(PLANT)
    knowledge.reset(4)
    observation, _ = env.reset(seed=3)
    for action in actions(4, 60):
        expected = knowledge.observe(observation[:, :ENTRIES])
        np.testing.assert_array_equal(observation, expected)
        observation = env.step(action)[0]
    assert np.ptp(observation[:, ENTRIES:], axis=0).max() > 0


@pytest.mark.parametrize("mode", ["SameStep", "NextStep"])
def test_an_episode_begins_with_an_unknown_valve_in_every_autoreset_mode(mode):
    env = observing(mode, max_episode_steps=20)
    observation, _ = env.reset(seed=3)
    unknown = observation[:, ENTRIES + 1].copy()  # the deviation of the opening pressure
    ends = []
    for action in actions(4, 42):
        observation, _, _, truncated, infos = env.step(action)
        ends.append(truncated[0])
        if mode == "SameStep" and truncated[0]:
            assert infos["final_obs"][0].shape == observation[0].shape
    assert sum(ends) == 2
    fresh = ends.index(True) if mode == "SameStep" else ends.index(True) + 1
    env.reset(seed=3)
    for k, action in enumerate(actions(4, 42)):
        shown = env.step(action)[0]
        if k == fresh:
            np.testing.assert_allclose(shown[:, ENTRIES + 1], unknown)
            assert np.all(shown[:, ENTRIES + 16] <= 4.0)


def test_advice_is_that_of_the_adaptive_pulse():
    pulse, knowledge = AdaptivePulse(plant=PLANT), ValveKnowledge(PLANT)
    env = observing("Disabled", max_episode_steps=None)
    observation, _ = env.reset(seed=5)
    pulse.reset(4)
    knowledge.reset(4)
    for _ in range(100):
        advised = pulse.act(observation[:, :ENTRIES])
        shown = knowledge.observe(observation[:, :ENTRIES])[:, -1]
        np.testing.assert_array_equal(shown, 2 * advised - 1)
        observation = env.step(advised)[0]
