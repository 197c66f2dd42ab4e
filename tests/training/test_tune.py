"""Tuning some kinds keeps what the file holds of the others, and refuses to mix budgets."""

import pytest

from controllers.tuned import Tuning, load_tunings, save_tunings
from epv_env.common.commands import main_of

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
