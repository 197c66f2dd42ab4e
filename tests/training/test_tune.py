"""Tuning some kinds keeps what the file holds of the others, and refuses to mix budgets."""

import pytest

from controllers.registration import Choice, Range
from controllers.tuned import Tuning, load_tunings, save_tunings
from epv_env.common.commands import main_of
from training.commands.tune import _search, widened

pytestmark = pytest.mark.training
SHORT = ("--trials", "1", "--episodes", "1", "--duration", "0.1")
SEARCH = {
    "method": "Optuna TPE on the mean return", "trials": 1, "episodes": 1, "duration": 0.1, "seed": 0,
}  # fmt: skip
OTHER = Tuning(values={"open_below": -0.1, "shut_above": 0.1}, trials=1, mean_return=-9.0, episodes=1)


def main(*arguments):
    return main_of("training.commands.tune", program="tune", arguments=[*SHORT, *arguments])


def test_one_kind_alone_is_searched_and_the_others_are_kept(tmp_path):
    path = tmp_path / "tuned.json"
    save_tunings({"hysteresis": OTHER}, path, SEARCH)
    kinds = ("--only", "extrapolating hysteresis")
    assert main(*kinds, "--out", str(path)) == 0
    found = load_tunings(path)
    assert list(found) == ["hysteresis", "extrapolating hysteresis"]
    assert found["hysteresis"] == OTHER


def test_another_budget_is_refused_and_the_file_left_alone(tmp_path, capsys):
    path = tmp_path / "tuned.json"
    save_tunings({"hysteresis": OTHER}, path, {**SEARCH, "trials": 100})
    assert main("--only", "hysteresis", "--out", str(path)) == 2
    assert "search all kinds anew" in capsys.readouterr().err
    assert load_tunings(path) == {"hysteresis": OTHER}


def test_a_wider_search_is_no_worse_than_the_one_before():
    space = {"x": Range(low=-100.0, high=100.0)}
    study = _search("any", space, lambda values: -abs(values["x"]), 3, 0, {"x": 1e-3})
    assert study.best_params == {"x": 1e-3}


def test_a_search_that_ends_at_a_bound_is_widened_to_its_physical_limit_at_most():
    space = {
        "depth": Range(low=0.1, high=1.0, log=True, most=5.0),
        "setpoint": Range(low=-0.4, high=0.4, least=-2.0),
        "lag": Choice(values=(1, 2)),
    }
    assert widened(space, {"depth": 0.5, "setpoint": 0.0, "lag": 2}) == space
    wider = widened(space, {"depth": 0.99, "setpoint": -0.39, "lag": 2})
    assert wider["depth"] == Range(low=0.1, high=5.0, log=True, most=5.0)
    setpoint = wider["setpoint"]
    assert isinstance(setpoint, Range)
    assert setpoint.low == pytest.approx(-1.2)
    # A second time the search goes no further than the limit.
    assert widened(wider, {"depth": 4.99, "setpoint": 0.0, "lag": 2}) == wider
