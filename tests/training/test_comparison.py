"""Comparisons are fair, repeatable, and can tell a good controller from a bad one."""

import numpy as np
import pytest

pytest.importorskip("pandas")

from controllers.hysteresis import Hysteresis
from epv_env.plant.plantfile import Plant
from training.evaluation.controller_table import PLANTS, compare
from training.evaluation.rollout import run_episodes

pytestmark = pytest.mark.training

GOOD = Hysteresis(open_below=-0.1, shut_above=0.0, shut_lookahead=0.03, name="good")
LATE = Hysteresis(open_below=-0.4, shut_above=0.4, name="late")
OPTIONS = {"scenario": "steps"}


def test_the_same_seeds_give_the_same_figures():
    first, _ = run_episodes(GOOD, seeds=[1, 2, 3], duration=1.5, options=OPTIONS)
    again, _ = run_episodes(GOOD, seeds=[1, 2, 3], duration=1.5, options=OPTIONS)
    np.testing.assert_array_equal(first.episode_return, again.episode_return)


def test_an_episode_does_not_depend_on_its_companions():
    many, _ = run_episodes(GOOD, seeds=list(range(20)), duration=1.0, options=OPTIONS)
    alone, _ = run_episodes(GOOD, seeds=[7], duration=1.0, options=OPTIONS)
    assert many.episode_return[7] == alone.episode_return[0]


def test_the_comparison_separates_good_from_late():
    found = compare([GOOD, LATE], plant=Plant.calibrated(), scenario="steps", episodes=24, duration=3.0)
    table = found.table.set_index(["plants", "controller"])
    for plants in PLANTS:
        good, late = table.loc[(plants, "good")], table.loc[(plants, "late")]
        assert good["C1_stayed"] > late["C1_stayed"]
        assert good["C1_stayed_low"] <= good["C1_stayed"] <= good["C1_stayed_high"]
        assert good["rms_error_bar"] < late["rms_error_bar"]
    assert set(found.traces) == {"good", "late"}
