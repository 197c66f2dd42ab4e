"""What cannot be used is refused at once, with one sentence that names it and the remedy."""

from typing import Any

import gymnasium
import numpy as np
import pytest

from epv_env.actions import ActionError
from epv_env.env import EPValveEnv
from epv_env.plant.parameters import ParameterError
from epv_env.signals import OptionError
from tests.env.rollouts import IDS, native

EITHER_WAY = [
    ({"scenario": "rain"}, ValueError, "unknown consumption scenario 'rain': choose one of mixed"),
    ({"scenario": 7}, OptionError, "scenario is 7: give the name of one"),
    ({"parameters": "hell"}, ParameterError, "unknown parameter region 'hell': choose one of"),
    ({"parameters": "diagnosis"}, OptionError, "'calibrated' has no alternatives to draw from: give"),
    ({"parameters": {"R": 60.0}}, ParameterError, r"R = 60 Ohm is outside its domain \[35, 50\]"),
    ({"parameters": {"R": (42.0, 41.0)}}, ParameterError, r"range of R is \[42, 41\]: give low <= h"),
    ({"parameters": {"R": "much"}}, ParameterError, "parameter R is 'much': give one number"),
    ({"effects": {"leaking_roof": 1.0}}, ValueError, "unknown effect 'leaking_roof'"),
    ({"supply": 20.0}, OptionError, r"supply = \[20, 20\] must satisfy 1 <= low <= high <= 16"),
    ({"target_bar": (1.0, 2.0, 3.0)}, OptionError, r"target_bar is .* a number or \(low, high\)"),
    ({"target_bar": (6.0, 11.0)}, OptionError, "target_bar up to 11 bar exceeds the supply's least"),
    ({"p2_bar": 1.2}, OptionError, "could begin with p2 = 1.2 bar, .*: raise target_bar or p2_bar"),
    ({"p3_bar": float("nan")}, OptionError, "p3_bar = .* must satisfy"),
    ({"conditions": "flood"}, OptionError, "conditions is 'flood': give one of ordinary, broad"),
    ({"conditions": {"flood": 0.1}}, OptionError, "unknown condition 'flood': known are"),
    ({"conditions": {"rest_s": (5.0, 2.0)}}, OptionError, "conditions: rest_s"),
    ({"conditions": {"most_effects": 0}}, OptionError, "most_effects = 0: give a whole number"),
    ({"conditions": {"target_steps": 1.0}, "target_bar": lambda t: 7.0}, OptionError, "target_steps"),
]
AT_CONSTRUCTION = [
    ({"foo": 1}, "unknown argument 'foo': known are plant, privileged, .* target_bar, .* sensor_noise"),
    ({"control_period": 2.0}, "control_period = 2 must lie in 0.0005 to 0.1"),
    ({"supply_voltage": 48.0}, "supply_voltage = 48 must lie in 0.1 to 32"),
    ({"settling_time": float("nan")}, "settling_time = nan must lie in 0 to 3600"),
    ({"sensor_noise": -1.0}, "sensor_noise = -1 must lie in 0 to 1000"),
    ({"weights": {"flood": 2.0}}, "unknown reward weight 'flood'"),
    ({"weights": {"band": -1.0}}, "weights: band = -1 must lie in 0 to"),
    ({"band_bar": 0.0}, "must lie above 0 and at most at 16 bar"),
    ({"drop_bar": (0.0, 5.0)}, "could begin with p2 = 1 bar, and the circuit counts as empty"),
]
WRONG: tuple[Any, ...] = (
    True, -1, 1e300, 10**400, float("nan"), "x", b"x", [], [[]], {"": {}}, object(), np.ones((2, 2)), 1j,
    lambda: 1, ("a", "b"), (10**400, 1), Ellipsis,
)  # fmt: skip
"""What no argument takes, but `privileged` True, and `sensor_noise` True (1)."""
ARGUMENTS = (
    "plant", "parameters", "supply", "scenario", "effects", "target_bar", "p2_bar", "p3_bar",
    "conditions", "band_bar", "control_period", "supply_voltage", "settling_time", "sensor_noise",
    "weights", "drop_bar", "privileged", "render_mode",
)  # fmt: skip
BATCHES = ("num_envs", "threads", "autoreset_mode", "max_episode_steps")


def assert_refused(call, name, value):
    """The call raises one short sentence of this package that names the argument."""
    with pytest.raises(ValueError, match=name) as found:
        call()
    text = str(found.value)
    assert "\n" not in text, value
    assert len(text) < 1000, value


@pytest.mark.parametrize("name", ARGUMENTS)
def test_a_value_that_an_argument_does_not_take_is_refused_in_a_sentence(name):
    for value in WRONG if name not in ("privileged", "sensor_noise") else WRONG[1:]:
        pattern = name.removesuffix("_bar").removesuffix("s").replace("parameter", "parameter|region")
        assert_refused(lambda v=value: EPValveEnv(**{name: v}).reset(), pattern, value)


@pytest.mark.parametrize("name", BATCHES)
def test_a_value_that_a_batch_does_not_take_is_refused_in_a_sentence(name):
    for value in WRONG:
        assert_refused(
            lambda v=value: native(IDS[0], **({"n": 2} | {"n" if name == "num_envs" else name: v})),
            name,
            value,
        )


@pytest.mark.parametrize("env", [EPValveEnv(), native(IDS[0], 2)], ids=["single", "batch"])
def test_what_reset_and_step_do_not_take_is_refused_in_a_sentence(env):
    env.reset(seed=0)
    for value in WRONG[1:]:  # True is 1, the coil on
        assert_refused(lambda v=value: env.reset(options=v), "option", value)
        assert_refused(lambda v=value: env.step(v), "action", value)
    for value in (True, -1, 1e300, "x", [1.5, 1], object(), np.float64(3.0)):
        assert_refused(lambda v=value: env.reset(seed=v), "seed", value)


@pytest.mark.parametrize(("options", "error", "message"), EITHER_WAY)
def test_a_bad_option_is_refused_everywhere(options, error, message):
    identifier = IDS[0]
    with pytest.raises(error, match=message):
        gymnasium.make(identifier, **options)
    with pytest.raises(error, match=message):
        gymnasium.make(identifier).reset(options=options)
    with pytest.raises(error, match=message):
        native(identifier, 2, **options)
    with pytest.raises(error, match=message):
        native(identifier, 2).reset(options=options)


@pytest.mark.parametrize(("options", "message"), AT_CONSTRUCTION, ids=str)
def test_a_bad_setting_is_refused(options, message):
    for make in (lambda: gymnasium.make("EPValve-v0", **options), lambda: native(IDS[1], 2, **options)):
        with pytest.raises(ValueError, match=message):
            make()


@pytest.mark.parametrize(
    ("identifier", "command"),
    [("EPValve-v0", 2), ("EPValve-v0", -1), ("EPValve-v0", np.nan), ("EPValvePWM-v0", np.nan)],
)
def test_an_action_outside_its_space_is_refused(identifier, command):
    env = native(identifier, 1)
    env.reset(seed=0)
    with pytest.raises(ActionError, match="are not all"):
        env.step(np.full(env.action_space.shape, command))


@pytest.mark.parametrize(("env", "action"), [(EPValveEnv(), 1), (native(IDS[0], 2), np.array([1, 1]))])
def test_reset_comes_before_the_first_step(env, action):
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"call reset\(\)"):
        env.step(action)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: EPValveEnv().reset(options={"colour": 1}), "unknown reset option 'colour': known are"),
        (lambda: native(IDS[0], 2).reset(options={"colour": 1}), "unknown reset option 'colour': known"),
        (lambda: EPValveEnv(render_mode=WRONG[5]), "unknown render_mode 'x': use 'rgb_array' or 'hum"),
        (lambda: native(IDS[0], 2, render_mode="rgb_array"), "does not render: use gymnasium"),
        (lambda: native(IDS[0], 2).reset(seed=[1, 2, 3]), "got 3 seeds for 2 environments: give one"),
        (lambda: native(IDS[0], 2).reset(options={"p2_bar": [6, 7, 8]}), "p2_bar lists 3 values for 2"),
        (lambda: native(IDS[0], 2, thread=1), "'thread': known are plant, .* num_envs, .* threads, dev"),
    ],
)
def test_what_is_unknown_or_of_another_number_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize(
    "action", [np.ma.array([1], mask=[True]), np.ma.masked, np.ma.array(1, mask=True)]
)
def test_an_action_under_a_mask_is_none(action):
    env = gymnasium.make("EPValve-v0")
    env.reset(seed=0)
    with pytest.raises(ActionError, match="no mask"):
        env.step(action)
    batch = native("EPValve-v0", 2)
    batch.reset(seed=0)
    for actions in (np.ma.array([1, 0], mask=[True, False]), [action, action]):
        with pytest.raises(ActionError, match="no mask"):
            batch.step(actions)


@pytest.mark.parametrize(
    ("mask", "message"),
    [
        ([True, False], r"must be a boolean array of shape \(2,\)"),
        (np.array([1, 0]), r"must be a boolean array of shape \(2,\)"),
        (np.array([True]), r"must be a boolean array of shape \(2,\)"),
        (np.array([False, False]), "selects no environment: set at least one True"),
    ],
    ids=str,
)
def test_a_bad_reset_mask_is_refused(mask, message):
    env = native("EPValve-v0", 2, autoreset_mode="Disabled")
    with pytest.raises(OptionError, match=message):
        env.reset(options={"reset_mask": mask})


def test_stepping_an_ended_sub_environment_is_refused():
    env = native("EPValve-v0", 2, autoreset_mode="Disabled", max_episode_steps=2)
    env.reset(seed=0)
    on = np.array([1, 1])
    env.step(on)
    env.step(on)
    env.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(OptionError, match="sub-environment 1 has ended: reset it with options="):
        env.step(on)
    env.reset(options={"reset_mask": np.array([False, True])})
    env.step(on)


def test_a_refused_reset_leaves_the_episodes_as_they_were():
    env, untouched = native("EPValve-v0", 2), native("EPValve-v0", 2)
    env.reset(seed=0)
    untouched.reset(seed=0)
    with pytest.raises(OptionError):
        env.reset(options={"target_bar": [7.0, 99.0]})
    on = np.array([1, 1])
    np.testing.assert_array_equal(env.step(on)[0], untouched.step(on)[0])
