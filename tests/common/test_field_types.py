"""Constructors refuse values of a wrong type in a sentence that says what to give."""

import numpy as np
import pytest

from controllers.policy import load_policy
from controllers.policy_files import PolicyError
from epv_env.conditions import Conditions
from epv_env.plant.consumption import Scenario
from epv_env.plant.parameters import ParameterError, Parameters
from epv_env.plant.plantfile import PlantFileError, load_plant
from epv_env.plant.supply import Supply
from epv_env.reward import RewardWeights
from epv_env.signals import MovingTarget, OptionError, RecordedConsumption, SignalError

ENDS, NOMINAL = (1e5, 2e5), Parameters.nominal()


@pytest.mark.parametrize(
    ("build", "wrong", "error", "says"),
    [
        (Supply, {"pressure": 7}, ValueError, "Supply: pressure is 7: give two numbers"),
        (Supply, {"pressure": (None, 2e5)}, ValueError, "pressure is .*: give two numbers"),
        (Supply, {"pressure": ENDS, "volume": "a"}, ValueError, "volume is 'a': give a number"),
        (Supply, {"pressure": ENDS, "recording": 7}, ValueError, "give two arrays of numbers, or None"),
        (Scenario, {"meaning": "a", "leak": None}, ValueError, "leak is None: give two numbers"),
        (Scenario, {"meaning": 4}, ValueError, "meaning is 4: give a text"),
        (RewardWeights, {"band": np.ones(3)}, ValueError, "band is array.*: give a number"),
        (RewardWeights, {"band": True}, ValueError, "band is True: give a number"),
        (Parameters, {"values": 7}, ParameterError, "values is 7: give a mapping"),
        (Parameters, {"values": NOMINAL, "own_domains": 7}, ParameterError, "is 7: give a mapping"),
        (Parameters, {"values": NOMINAL, "own_domains": {"R": 7}}, ParameterError, "give two numbers"),
        (load_plant, {"source": 7}, PlantFileError, "7: give a Plant, the path"),
        (MovingTarget, {"at": 7}, SignalError, "at is 7: give a function"),
        (RecordedConsumption, {"time": [0, 1], "flow": [-1, 2]}, SignalError, "flows of at least 0"),
        (Conditions, {"far": (0.1, 0.2)}, OptionError, "far is .*: give a number from 0 to 1"),
        (load_policy, {"folder": 7}, PolicyError, "7: give the path of a folder"),
        (load_policy, {"plant": 7}, PlantFileError, "7: give a Plant, the path"),
    ],
)
def test_a_wrong_type_is_refused_in_a_sentence(build, wrong, error, says):
    with pytest.raises(error, match=says):
        build(**wrong)


@pytest.mark.parametrize(
    ("build", "given"),
    [
        (Supply, {"pressure": np.array(ENDS), "volume": np.float32(0.04)}),
        (Supply, {"pressure": list(ENDS), "recording": (np.ones(2), np.ones(2))}),
        (RecordedConsumption, {"time": [0, 1], "flow": [1, 2]}),
    ],
)
def test_numbers_of_any_library_are_numbers(build, given):
    build(**given)
