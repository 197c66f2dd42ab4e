"""What cannot be used is refused at once, with one sentence that names it and the remedy."""

import json
from typing import Any

import gymnasium
import numpy as np
import pytest

from epv_env.actions import ActionError
from epv_env.env import EPValveEnv
from epv_env.plant.parameters import ParameterError
from epv_env.plant.plantfile import PlantFileError
from epv_env.signals import OptionError
from tests.env.rollouts import IDS, native

EITHER_WAY = [
    ({"scenario": "rain"}, ValueError, "unknown consumption scenario 'rain': choose one of mixed"),
    ({"parameters": "hell"}, ParameterError, "unknown parameter region 'hell': choose one of"),
    ({"parameters": {"x": 1.0}}, ParameterError, "unknown parameter 'x': known symbols are"),
    ({"parameters": {"R": 60.0}}, ParameterError, r"R = 60 Ohm is outside its domain \[35, 50\]"),
    ({"parameters": {"R": (40.0, 60.0)}}, ParameterError, "R = 60 Ohm is outside its domain"),
    ({"parameters": {"R": (42.0, 41.0)}}, ParameterError, r"range of R is \[42, 41\]: give low <= h"),
    ({"parameters": {"R": (1.0, 2.0, 3.0)}}, ParameterError, r"range of R is .* give \(low, high\)"),
    ({"parameters": {"R": "much"}}, ParameterError, "parameter R is 'much': give one number"),
    ({"parameters": {"R": float("nan")}}, ParameterError, "R = nan Ohm is outside its domain"),
    ({"parameters": {"kappa": 1.3}}, ParameterError, "leave this constant out"),
    ({"supply": 20.0}, OptionError, r"supply = \[20, 20\] must satisfy 1 <= low <= high <= 16"),
    ({"supply": "much"}, OptionError, "supply is 'much': give a number"),
    ({"target_bar": (8.0, 7.0)}, OptionError, r"target_bar = \[8, 7\] must satisfy"),
    ({"target_bar": 0.5}, OptionError, r"target_bar = \[0.5, 0.5\] must satisfy"),
    ({"target_bar": (1.0, 2.0, 3.0)}, OptionError, r"target_bar is .* a number or \(low, high\)"),
    ({"target_bar": (6.0, 11.0)}, OptionError, "target_bar up to 11 bar exceeds the supply's least"),
    ({"supply": 9.0}, OptionError, "9.5 bar exceeds the supply's least pressure, 9 bar: lower"),
    ({"p2_bar": 1.2}, OptionError, "could begin with p2 = 1.2 bar, .*: raise target_bar or p2_bar"),
    ({"p2_bar": float("nan")}, OptionError, "p2_bar = .* must satisfy"),
    ({"p3_bar": (1.0, 17.0)}, OptionError, "p3_bar = .* must satisfy"),
]
AT_CONSTRUCTION = [
    ({"control_period": 0.0}, "control_period = 0 s must lie between 0.5 ms and 100 ms"),
    ({"control_period": 2.0}, "control_period = 2 s must lie between"),
    ({"control_period": float("nan")}, "control_period = nan s must lie between"),
    ({"supply_voltage": 0.0}, r"supply_voltage = 0 V must lie in \(0, 32\]"),
    ({"supply_voltage": 48.0}, "supply_voltage = 48 V must lie in"),
    ({"settling_time": float("nan")}, "settling_time = nan s must be at least 0"),
    ({"settling_time": -1.0}, "settling_time = -1.0 s must be at least 0"),
    ({"sensor_noise": -1.0}, "sensor_noise = -1.0 must lie in 0 to 1000"),
    ({"weights": [1.0]}, "weights is .*: give a RewardWeights"),
    ({"drop_bar": (2.0, 1.0)}, r"drop_bar = \[2, 1\] must satisfy"),
    ({"drop_bar": (-20.0, -20.0)}, r"drop_bar = \[-20, -20\] must satisfy"),
    ({"drop_bar": (0.0, 5.0)}, "could begin with p2 = 1 bar, and the circuit counts as empty"),
]
PLANT_FILES = [
    ("not json", r"is not JSON .* write it anew"),
    ("[1, 2]", "has format None, this version reads 'epv-plant/1'"),
    (json.dumps({"format": "epv-plant/9"}), "has format 'epv-plant/9', this version reads"),
    (json.dumps({"format": "epv-plant/1"}), "field 'parameters' is missing"),
    (json.dumps({"format": "epv-plant/1", "parameters": {"x": 1}}), "unknown parameter 'x'"),
    (json.dumps({"format": "epv-plant/1", "parameters": {"R": 99}}), "R = 99 Ohm is outside"),
]


@pytest.mark.parametrize("identifier", IDS)
@pytest.mark.parametrize(("options", "error", "message"), EITHER_WAY, ids=str)
def test_a_bad_option_is_refused_everywhere(identifier, options, error, message):
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
        with pytest.raises(OptionError, match=message):
            make()


def test_a_scenario_that_is_no_name_is_refused():
    with pytest.raises(ValueError, match="unknown consumption scenario"):
        gymnasium.make("EPValve-v0", scenario=["leak"])


@pytest.mark.parametrize(
    ("identifier", "command"),
    [("EPValve-v0", 2), ("EPValve-v0", -1), ("EPValve-v0", np.nan), ("EPValvePWM-v0", np.nan)],
)
def test_an_action_outside_its_space_is_refused(identifier, command):
    env = native(identifier, 1)
    env.reset(seed=0)
    with pytest.raises(ActionError, match="are not all"):
        env.step(np.full(env.action_space.shape, command))


def test_a_batch_is_reset_before_its_first_step():
    with pytest.raises(Exception, match="reset"):
        native("EPValve-v0", 2).step(np.array([1, 1]))


def test_an_unknown_setting_is_refused():
    with pytest.raises(TypeError, match="unexpected keyword argument 'colour'"):
        gymnasium.make("EPValve-v0", colour="red")


@pytest.mark.parametrize("make", [lambda: gymnasium.make(IDS[0]), lambda: native(IDS[0], 2)])
def test_an_unknown_reset_option_is_refused(make):
    with pytest.raises(OptionError, match="unknown reset option 'colour': known are parameters, "):
        make().reset(options={"colour": "red"})


def test_an_unknown_render_mode_is_refused():
    mode: Any = "ascii"
    with pytest.raises(ValueError, match="unknown render_mode 'ascii': use 'rgb_array' or 'human'"):
        EPValveEnv(render_mode=mode)


@pytest.mark.parametrize(("content", "message"), PLANT_FILES, ids=lambda text: text[:30])
def test_a_bad_plant_file_is_refused(tmp_path, content, message):
    path = tmp_path / "plant.json"
    path.write_text(content)
    with pytest.raises(PlantFileError, match=message):
        gymnasium.make("EPValve-v0", plant=path)


def test_a_missing_plant_file_is_refused(tmp_path):
    with pytest.raises(PlantFileError, match=r"cannot read plant file .*No such file"):
        native("EPValve-v0", 2, plant=tmp_path / "no.json")


def test_a_batch_has_at_least_one_environment():
    with pytest.raises(OptionError, match="num_envs = 0: give a whole number of at least 1"):
        native("EPValve-v0", 0)


def test_a_batch_does_not_render():
    with pytest.raises(OptionError, match="does not render: use gymnasium"):
        native("EPValve-v0", 2, render_mode="rgb_array")


def test_as_many_seeds_as_environments_are_needed():
    with pytest.raises(OptionError, match="got 3 seeds for 2 environments: give one each"):
        native("EPValve-v0", 2).reset(seed=[1, 2, 3])


def test_as_many_list_entries_as_environments_are_needed():
    with pytest.raises(OptionError, match="target_bar lists 3 values for 2 environments"):
        native("EPValve-v0", 2).reset(options={"target_bar": [6.0, 7.0, 8.0]})


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


def test_an_unknown_autoreset_mode_is_refused():
    with pytest.raises(ValueError, match="'Sometimes' is not a valid AutoresetMode"):
        native("EPValve-v0", 2, autoreset_mode="Sometimes")
