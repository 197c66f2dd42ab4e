"""The scenarios beyond training are what they say, can be met, and come as a table."""

import json
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("pandas")

from controllers.hysteresis import Hysteresis
from epv_env.plant.consumption import MIXED
from epv_env.plant.plantfile import Plant
from epv_env.reward import REFERENCE_PERIOD
from epv_env.settings import make_settings
from training import hard_scenarios
from training.evaluation.faults import Restart
from training.evaluation.hard_scenarios import HARD, REFILL_TIME, VENTED_DROP_BAR
from training.evaluation.rollout import run_episodes
from training.evaluation.scenarios import TUNING_REGION
from training.studies import hard_scenarios as study_of_hard_scenarios
from training.studies.episode_tasks import Study
from training.studies.hard_scenarios import all_scenarios, run_scenario, worn_scenarios

pytestmark = pytest.mark.training


class Recorder(Hysteresis):
    """Notes what it sees and when it is reset."""

    def __init__(self) -> None:
        super().__init__(open_below=-0.1, shut_above=0.0)
        self.seen, self.resets = [], []

    def reset(self, n):
        self.resets.append((n, len(self.seen)))
        super().reset(n)

    def act(self, observations):
        self.seen.append(observations.copy())
        return super().act(observations)


class Shut(Hysteresis):
    """Keeps the coil on, which shuts the valve."""

    def act(self, observations):
        return np.ones(len(observations), dtype=int)


class Open(Hysteresis):
    """Keeps the coil off, which opens the valve."""

    def act(self, observations):
        return np.zeros(len(observations), dtype=int)


@pytest.mark.parametrize("name", all_scenarios())
def test_the_environment_accepts_every_scenario(name):
    options = {"control_period": REFERENCE_PERIOD, **all_scenarios()[name].all_options}
    assert make_settings(Plant.calibrated(), **options).control_period > 0
    assert all_scenarios()[name].meaning


def test_every_typical_effect_is_worn_once():
    assert len(worn_scenarios()) > 30
    assert all(len(scenario.options["effects"]) == 1 for scenario in worn_scenarios().values())


def test_a_restart_makes_the_controller_forget_once_at_its_time():
    inner = Recorder()
    controller = Restart(at=0.05).around(inner, 0.005)
    run_episodes(controller, seeds=[1, 2], duration=0.1, options={})
    assert inner.resets == [(2, 0), (2, 10)]


def test_an_open_valve_refills_within_the_settling_time():
    options = {
        "parameters": TUNING_REGION, "drop_bar": (4.4, 4.4), "scenario": "none",
        "settling_time": REFILL_TIME,
    }  # fmt: skip
    metrics, _ = run_episodes(
        Open(open_below=-0.1, shut_above=0.0), seeds=list(range(16)), duration=2.0, options=options
    )
    assert np.all(metrics.breakdown_bar < 0.5)


@pytest.mark.parametrize(("drop", "avoidable"), [(VENTED_DROP_BAR[0], True), (0.3, False)])
def test_a_vented_valve_can_be_shut_in_time_only_from_far_below(drop, avoidable):
    options = {
        "parameters": TUNING_REGION, "p3_bar": (1.0, 1.0), "drop_bar": (drop, drop), "scenario": "none",
    }  # fmt: skip
    _, trace = run_episodes(
        Shut(open_below=-0.1, shut_above=0.0), seeds=list(range(16)), duration=1.5, options=options,
        trace_of=0,
    )  # fmt: skip
    assert trace is not None
    assert (trace.p2_bar.max() < trace.target_bar + 0.5) == avoidable


def test_a_starved_circuit_reaches_its_band_once_refilled_and_not_before():
    scenario = HARD["starved"]
    controller = Hysteresis(open_below=0.0, shut_above=0.0)
    for duration, reached in ((2.9, False), (4.5, True)):
        _, trace = run_episodes(
            controller, seeds=list(range(4)), duration=duration, options=scenario.all_options, trace_of=0
        )
        assert trace is not None
        assert (trace.p2_bar.max() > trace.target_bar - 0.5) == reached


def test_the_command_writes_a_table(tmp_path, capsys):
    names = ["restart", "p3 frozen"]
    arguments = ["--quick", "--out", str(tmp_path), "--scenarios", *names]
    assert hard_scenarios.main(arguments) == 0
    content = json.loads((tmp_path / hard_scenarios.RESULT).read_text())
    assert [row["scenario"] for row in content["rows"]] == names
    assert all(0 <= row["C1_stayed"] <= 1 for row in content["rows"])
    assert "restart" in capsys.readouterr().out


def test_the_episodes_that_left_are_named_and_leave_again(tmp_path):
    """It leaves in some of six episodes; those alone leave in a second run."""
    rows = []
    for chosen in (["--episodes", "6"], ["--seeds"]):
        seeds = [str(seed) for row in rows for seed in row["left_seeds"]]
        scenario = ["--scenarios", "target steps", "--controllers", "hysteresis, extrapolating"]
        assert hard_scenarios.main(["--out", str(tmp_path), *scenario, *chosen, *seeds]) == 0
        rows = json.loads((tmp_path / hard_scenarios.RESULT).read_text())["rows"]
    assert 0 < len(rows[0]["left_seeds"]) < 6
    assert rows[0]["episodes"] == len(rows[0]["left_seeds"])


def test_only_evaluation_seeds_are_taken(tmp_path, capsys):
    with pytest.raises(SystemExit):
        hard_scenarios.parse(["--out", str(tmp_path), "--seeds", "7"])
    assert "--seeds: 7 is none from 2000000 to 2999999" in capsys.readouterr().err


def test_seeds_and_a_number_of_episodes_exclude_each_other(tmp_path, capsys):
    with pytest.raises(SystemExit):
        hard_scenarios.parse(["--out", str(tmp_path), "--seeds", "2000001", "--episodes", "6"])
    assert "--episodes: not allowed with argument --seeds" in capsys.readouterr().err


def test_the_command_names_an_unknown_scenario(tmp_path, capsys):
    with pytest.raises(SystemExit):
        hard_scenarios.parse(["--out", str(tmp_path), "--scenarios", "no such"])
    assert "no scenario 'no such': choose from" in capsys.readouterr().err


def test_episodes_in_batches_are_those_of_one_run(monkeypatch):
    study = Study(
        controllers={"open": Open(open_below=-0.1, shut_above=0.0)}, plant=Plant.calibrated(),
        scenario=MIXED, duration=10.0,
    )  # fmt: skip
    scenario = replace(HARD["as in training"], duration=1.0)
    whole = run_scenario(study, "open", scenario, range(5))
    monkeypatch.setattr(study_of_hard_scenarios, "SIDE_BY_SIDE", 2)
    assert np.array_equal(
        run_scenario(study, "open", scenario, range(5)).excursion_bar, whole.excursion_bar
    )
