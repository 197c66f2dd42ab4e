"""The supervisor suits the setpoint to the valve, shuts unfed valves, and ends long pulses."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from controllers.governor import LARGE
from controllers.hysteresis import Hysteresis
from controllers.learned import TRAINED, load_policy
from controllers.privileged_pulse import PrivilegedPulse
from controllers.pulse import Pulse
from controllers.supervised import supervised
from controllers.supervisor import Supervisor
from controllers.supervisor_settings import SupervisorSettings
from controllers.tuned import build, load_tunings
from controllers.valve_learner import ValveLearner
from epv_env.observation import LAYOUT, decode, encode
from epv_env.plant.plantfile import Plant
from training.evaluation.rollout import run_episodes
from training.evaluation.scenarios import BEYOND, TUNING_REGION


@dataclass(kw_only=True)
class Recorder:
    """Always switches off, and keeps what it was shown."""

    name: str = "off"
    environment: str = "EPValve-v0"

    def reset(self, n: int) -> None:
        self.shown: list[np.ndarray] = []

    def act(self, observations):
        self.shown.append(observations)
        return np.zeros(len(observations), dtype=int)


def supervisor(main, **settings) -> Supervisor:
    control = supervised(main, Plant.calibrated(), SupervisorSettings(**settings)).main
    assert isinstance(control, Supervisor)
    return control


def at_rest(**values):
    """Readings of three valves at rest: coil on, p3 at p1, p2 at the target of 8 bar."""
    usual = {"target": 8.0, "p1": 11.0, "p3": 11.0, "action": 1.0, "p2_error": 0.0}
    mine = {quantity.name: np.full(3, quantity.centre) for quantity in LAYOUT}
    chosen = {name: np.broadcast_to(np.asarray(v, float), 3) for name, v in (usual | values).items()}
    return encode(mine | chosen)


def test_the_setpoint_rises_with_the_expected_breakdown():
    control = supervisor(Recorder())
    control.reset(3)
    valve = control.governor._learner.observe(at_rest())
    slower = replace(valve, pace=valve.pace * np.array([1.25, 0.8, 0.6]))
    shifts = control.governor.shift(slower, control.governor.reserve(slower), np.zeros(3))
    assert shifts[0] == 0.0  # a fast valve needs no reserve
    assert 0.0 < shifts[1] < shifts[2]


def test_a_valve_that_is_known_less_needs_more_reserve():
    control = supervisor(Recorder(), wariness=0.2)
    control.reset(3)
    valve = replace(control.governor._learner.observe(at_rest()), pace=np.full(3, 0.8))
    known, unknown = (
        control.governor.reserve(replace(valve, offset_deviation=np.full(3, deviation)))
        for deviation in (0.0, 0.5)
    )
    assert unknown - known == pytest.approx(0.1)


def test_the_height_shifts_every_setpoint_alike():
    controls = [supervisor(Recorder(), height=height) for height in (0.0, -0.03)]
    for control in controls:
        control.reset(3)
    valve = controls[0].governor._learner.observe(at_rest())
    high, low = (
        control.governor.shift(valve, control.governor.reserve(valve), np.zeros(3))
        for control in controls
    )
    assert high - low == pytest.approx(0.03)


def test_the_policy_is_shown_a_p2_that_is_lower_by_the_shift():
    main = Recorder()
    control = supervisor(main, height=0.04, tolerated=10.0)
    control.reset(3)
    observations = at_rest()
    control.act(observations)
    lowered = decode(observations, "p2_error") - decode(main.shown[0], "p2_error")
    assert lowered == pytest.approx(0.04, abs=1e-6)
    assert np.array_equal(observations, at_rest())  # the caller's array is left alone


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"height": 0.6}, "height = 0.6 bar"), ({"height": float("nan")}, "height"),
        ({"free_below": -0.7}, "free_below = -0.7 bar"), ({"reluctance": -1.0}, "reluctance = -1"),
        ({"share": -1.0}, "share = -1"), ({"filter_time": 0.0}, "filter_time = 0 s"),
        ({"confidence": 1.0}, "confidence = 1"), ({"horizon": -0.1}, "horizon = -0.1"),
        ({"near_miss_share": -0.1}, "near_miss_share = -0.1"), ({"near_miss": -0.1}, "near_miss = -0.1"),
        ({"memory_time": 0.0}, "memory_time = 0 s"),
    ],
)  # fmt: skip
def test_settings_without_a_meaning_are_refused(settings, words):
    with pytest.raises(ValueError, match=words):
        SupervisorSettings(**settings)


@dataclass(kw_only=True)
class Undecided(Recorder):
    """Prefers switching off by 2."""

    def logits(self, observations):
        return np.tile([2.0, 0.0], (len(observations), 1))


def test_the_farther_p2_is_above_what_sets_a_pulse_free_the_more_clearly_it_has_to_be_wanted():
    """At 50/bar a preference of 2 suffices up to 0.04 bar above."""
    control = supervisor(Undecided(), reluctance=50.0, free_below=-0.02)
    control.reset(3)
    assert control.act(at_rest(p2_error=[-0.03, 0.01, 0.03])).tolist() == [0, 0, 1]
    assert np.all(control.act(at_rest(p2_error=0.03, action=0.0)) == 0)  # one under way goes on


def test_consumption_sets_a_pulse_free_before_p2_is_low():
    """p2 falls by 10 mbar a period, or not at all, and is above the target when a pulse is asked for."""
    control = supervisor(Undecided(), reluctance=1000.0, free_below=-0.02)
    control.reset(3)
    actions = [control.act(at_rest(p2_error=[0.12 - 0.01 * k, 0.03, 0.03])) for k in range(10)]
    assert actions[-1].tolist() == [0, 1, 1]


def test_a_slow_valve_may_not_hesitate():
    """At a tolerated breakdown of nothing every valve needs all the reserve that there is."""
    for tolerated, action in ((0.0, 0), (10.0, 1)):
        control = supervisor(Undecided(), reluctance=100.0, free_below=-0.1, tolerated=tolerated)
        control.reset(3)
        assert np.all(control.act(at_rest()) == action)


def test_after_a_near_miss_no_pulse_waits():
    """The circuits break down by 0.1, 0.3 and 0.4 bar, and are at the target again afterwards."""
    control = supervisor(Undecided(), reluctance=50.0, free_below=-0.1, near_miss=0.2)
    control.reset(3)
    assert control.act(at_rest()).tolist() == [1, 1, 1]
    for _ in range(40):
        control.act(at_rest(p2_error=[-0.1, -0.3, -0.4]))
    actions = [control.act(at_rest()) for _ in range(40)]  # the slope of p2 fades
    assert actions[-1].tolist() == [1, 0, 0]


def test_after_a_near_miss_p2_is_held_higher():
    main = Recorder()
    control = supervisor(main, near_miss_share=0.5, near_miss=0.2, tolerated=10.0)
    control.reset(3)
    control.act(at_rest())
    control.act(at_rest(p2_error=[-0.1, -0.3, -0.4], action=0.0, p3=1.0))  # open: p2 is not filtered
    control.act(at_rest())
    np.testing.assert_allclose(decode(main.shown[-1], "p2_error"), [0.0, -0.05, -0.1], atol=1e-3)


def test_without_reluctance_a_policy_acts_as_alone():
    policy = load_policy(TRAINED / "end-to-end" / "seed-0")
    control = supervisor(policy, ceiling=100.0, tolerated=100.0)
    alone, watched = (
        run_episodes(each, seeds=[0, 1, 2], duration=2.0, options={"threads": 1})[0]
        for each in (policy, control)
    )
    assert np.array_equal(alone.episode_return, watched.episode_return)


def test_a_valve_that_the_supply_cannot_feed_is_kept_shut():
    control = supervisor(Recorder())
    control.reset(3)
    assert control.act(at_rest(p1=[11.0, 8.1, 7.0], p3=[11.0, 8.1, 7.0])).tolist() == [0, 1, 1]


def test_a_pulse_that_would_rise_beyond_the_ceiling_ends():
    control = supervisor(Recorder())
    control.reset(3)
    open_valves = at_rest(p3=1.5, action=0.0, p2_error=[-4.5, -0.2, 0.2])
    assert control.act(open_valves).tolist() == [0, 1, 1]


def under_way(p2_error, p3=6.9, **settings):
    """What is decided of three unknown valves at p3 [bar]: the nominal one opens at 6.5 bar."""
    control = supervisor(Recorder(), **settings)
    control.reset(3)
    return control.act(at_rest(p3=p3, action=0.0, p2_error=p2_error)).tolist()


def test_a_pulse_ends_before_the_nominal_valve_opens_if_an_earlier_one_would_rise_too_far(monkeypatch):
    valve = ValveLearner(supervisor(Recorder()).table, filter_time=0.025, control_period=5e-3)
    valve.reset(3)
    assert np.all(valve.observe(at_rest(p3=6.9, action=0.0)).shut)
    assert under_way([-0.6, -0.1, 0.1]) == [0, 1, 1]
    monkeypatch.setattr("controllers.governor.UNKNOWN_DEVIATION", 1.0)
    assert under_way([-0.6, -0.1, 0.1], confidence=0.5) == [0, 0, 0]  # as of a nominal valve


def test_an_earlier_opening_is_allowed_for_while_a_valve_is_unknown(monkeypatch):
    """p3 falls to 7.6 bar in a period. Of 100 valves five open above 7.3 bar, one above 7.7 bar."""
    assert under_way([0.1, 0.1, 0.1], p3=7.9) == [1, 1, 1]
    monkeypatch.setattr("controllers.governor.UNKNOWN_DEVIATION", 1.0)
    assert under_way([0.1, 0.1, 0.1], p3=7.9) == [0, 0, 0]


def test_an_emergency_goes_on_where_the_same_p2_at_rest_would_end_the_pulse():
    """p2 falls by 15 mbar a period, or stands still, until both are 0.3 bar below the target."""
    control = supervisor(Recorder())
    control.reset(3)
    for k in range(10):
        falling = -0.3 + 0.015 * (9 - k)
        control.act(at_rest(p2_error=[falling, -0.3, -0.3]))
    assert control.act(at_rest(p2_error=-0.3, p3=7.1, action=0.0)).tolist() == [0, 1, 1]


def test_in_an_emergency_near_the_end_of_the_band_no_pulse_is_ended():
    """p2 falls by 15 mbar a period, or stands still, until it is 0.3 or 0.4 bar below the target."""
    control = supervisor(Recorder(), ceiling=-0.3, horizon=0.0)
    control.reset(3)
    for k in range(10):
        above = 0.015 * (9 - k)
        control.act(at_rest(p2_error=[above - 0.4, -0.4, above - 0.3]))
    assert control.act(at_rest(p2_error=[-0.4, -0.4, -0.3], p3=6.0, action=0.0)).tolist() == [0, 1, 1]


def test_a_large_rise_is_doubted_twice_as_much(monkeypatch):
    """A vented valve closes late: with the usual doubt of a gain, the rise would end at the ceiling."""
    probe = supervisor(Recorder()).governor._learner
    probe.reset(3)
    valve = probe.observe(at_rest(p3=1.0, action=0.0, p2_error=-3.0))
    rise = probe.earliest(0.95).gained_at_once(valve.p1, valve.p2, valve.p3)[0]
    usual = 1.0 + 2.0 * valve.gain_deviation[0]
    assert rise > 2 * LARGE
    reading = at_rest(p3=1.0, action=0.0, p2_error=-3.0)
    for large, action in ((LARGE, 1), (100.0, 0)):
        monkeypatch.setattr("controllers.governor.LARGE", large)
        control = supervisor(Recorder(), ceiling=usual * rise - 3.0 + 0.1)
        control.reset(3)
        assert np.all(control.act(reading) == action)


def test_a_pulse_that_was_ended_is_measured_before_the_next_one():
    control = supervisor(Recorder())
    control.reset(3)
    ended = control.act(at_rest(p3=6.9, action=0.0))
    waits = control.act(at_rest(p3=7.5, action=1.0))
    measured = [control.act(at_rest(p3=p3, action=1.0)) for p3 in (9.0, 10.0)]
    assert [int(actions[0]) for actions in (ended, waits, measured[-1])] == [1, 1, 0]


@pytest.mark.parametrize("name", ["restart", "latency of 5 ms"])
def test_the_supervised_policy_leaves_less_often(name):
    scenario = BEYOND[name]
    policy = load_policy(TRAINED / "end-to-end" / "seed-0")
    left = []
    for control in (policy, supervisor(policy)):
        faulty = scenario.fault.around(control, 5e-3) if scenario.fault else control
        metrics, _ = run_episodes(
            faulty, seeds=list(range(3_500_000, 3_500_256)), duration=6.0,
            options={"scenario": "mixed", "parameters": TUNING_REGION, **scenario.options},
        )  # fmt: skip
        left.append(np.sum(~metrics.stayed))
    assert left[1] < 0.7 * left[0]


def test_the_policy_gets_the_control_period():
    pulse = build("pulse", load_tunings()["pulse"].values, Plant.calibrated())
    main = replace(supervisor(pulse), control_period=4e-3).main
    assert isinstance(main, Pulse)
    assert main.control_period == 4e-3


def test_controllers_without_pulses_or_sensors_are_refused():
    other = Hysteresis(open_below=-0.1, shut_above=0.0, environment="EPValvePWM-v0")
    with pytest.raises(ValueError, match="give a controller for EPValve-v0"):
        supervisor(other)
    with pytest.raises(ValueError, match="reads no sensor"):
        supervisor(PrivilegedPulse())


def test_a_governor_forgets_only_the_valves_whose_episodes_end():
    """After ended pulses and their measurements, one valve is as new and the others are as they were."""
    governor = supervisor(Recorder()).governor
    governor.reset(3)
    readings = [at_rest(p3=p3, action=0.0, p2_error=-0.1) for p3 in (9.0, 7.5, 6.9)]
    readings += [at_rest(p3=p3, p2_error=0.1) for p3 in (9.0, 10.0, 11.0)]
    for observations in readings:
        governor.decided(np.where(governor.advise(observations).must_shut, 1, 0))
    before = {name: getattr(owner, own).copy() for name, owner, own in governor.arrays()}
    governor.forget(np.array([1]))
    new = supervisor(Recorder()).governor
    new.reset(3)
    fresh = {name: getattr(owner, own) for name, owner, own in new.arrays()}
    for name, owner, own in governor.arrays():
        now = getattr(owner, own)
        assert np.array_equal(now[[0, 2]], before[name][[0, 2]])
        assert np.array_equal(now[1], fresh[name][1])
    assert not np.array_equal(before["probability"], fresh["probability"])
