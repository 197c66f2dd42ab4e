"""The adaptive hysteresis learns its valve; the extrapolating one keeps its two times."""

from typing import Any

import numpy as np
import pytest

from controllers.adaptive_hysteresis import AdaptiveHysteresis
from controllers.pulse_simulation import pulse_table
from epv_env.plant.parameters import Parameters
from training.evaluation.rollout import run_episodes

pytestmark = pytest.mark.training
PLANT = Parameters.calibrated()
SETTINGS: dict[str, Any] = {
    "open_below": -0.06, "shut_above": 0.0, "filter_time": 0.0125, "look_ahead": 1.05,
}  # fmt: skip
STIFF = {"cPV": 1.1 * PLANT["cPV"], "xPV0": 1.05 * PLANT["xPV0"]}


@pytest.fixture(scope="module")
def table():
    return pulse_table(PLANT)


def rms(controller, parameters, begin):
    metrics, _ = run_episodes(
        controller, seeds=list(range(begin, begin + 16)), duration=5.0,
        options={"parameters": parameters, "scenario": "steps"},
    )  # fmt: skip
    return np.sqrt(np.mean(metrics.rms_bar**2))


class Forgetful(AdaptiveHysteresis):
    """Begins anew in every period: it never learns."""

    def act(self, observations):
        self.reset(len(observations))
        return super().act(observations)


def test_it_controls_a_stiffer_valve_better_than_without_what_it_learns(table):
    learning, forgetful = AdaptiveHysteresis(table=table, **SETTINGS), Forgetful(table=table, **SETTINGS)
    assert rms(learning, STIFF, 0) < 0.9 * rms(forgetful, STIFF, 0)


def test_another_episode_begins_without_memory_of_the_last(table):
    controller = AdaptiveHysteresis(table=table, **SETTINGS)
    first = rms(controller, {}, 100)
    rms(controller, STIFF, 200)
    assert rms(controller, {}, 100) == first


def test_thresholds_in_the_wrong_order_are_refused(table):
    with pytest.raises(ValueError, match="a hysteresis needs open_below <= shut_above"):
        AdaptiveHysteresis(table=table, **{**SETTINGS, "open_below": 0.1})
