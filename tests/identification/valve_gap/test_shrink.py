"""The valve's errors in percent are those of the validation stage."""

import numpy as np
import pytest

from identification.calibration.problem import calibration_problem
from identification.gap.prediction import percentage_errors
from identification.replay.replay import total_response_error
from identification.validation import validate
from identification.valve_gap.valve import Valve
from tests.identification.valve_gap.test_valve import campaign


def test_percent_is_the_validation_stage_s():
    valve = Valve(campaign())
    nominal = {"R": np.array([valve.base["R"]])}
    outputs = [y[..., 0] for y in valve.outputs(nominal, range(len(valve.runs)))]
    found = percentage_errors(valve, outputs)
    answers = validate(calibration_problem(campaign()), valve.base).answers
    assert found is not None
    assert found["overall"] == pytest.approx(100 * total_response_error(answers), rel=1e-9)
    for channel in valve.channels:
        each = [answer.errors[channel.name] for answer in answers]
        assert found[channel.name] == pytest.approx(100 * np.sqrt(np.mean(np.square(each))), rel=1e-9)
