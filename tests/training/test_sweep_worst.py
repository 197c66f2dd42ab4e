"""The worst-case search finds what is planted, on a made-up valve and on the real one."""

import json
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from controllers.hysteresis import Hysteresis
from epv_env.observation import decode
from epv_env.plant.plantfile import Plant
from epv_env.plant.region import Region
from training.studies.episode_tasks import Study
from training.studies.sweeps import worst_case_search
from training.studies.sweeps.worst_case_search import Effort, Search
from training.sweep import main

pytestmark = pytest.mark.training

PLANT = Plant.calibrated()


def search(region: str, effort: Effort, seed: int = 0) -> Search:
    return Search(
        name="s", controller="c", region=region, first_seed=1000, seed=seed, effort=effort
    )  # fmt: skip


class MadeUp:
    """A study whose excursion is greatest at one plant, in one scenario, and at every 50th seed."""

    scenario = "mixed"
    plant = PLANT

    def __init__(self, spot: float):
        self.boxes = Region.named("sensitive_ten_percent", PLANT.parameters).boxes
        self.spot = spot

    def run(self, controller: str, seeds: list[int], options: dict, each: dict[str, list]) -> Any:
        ends = np.array(list(self.boxes.values()))
        plants = np.array([[plant[s] for s in self.boxes] for plant in each["parameters"]])
        place = (plants - ends[:, 0]) / np.ptp(ends, axis=1)
        excursion = 1.0 - np.mean((place - self.spot) ** 2, axis=1)
        excursion += 0.2 * np.array([name == "pumping" for name in each["scenario"]])
        excursion += 0.1 * (np.array(seeds) % 50 == 0)
        return SimpleNamespace(excursion_bar=excursion), None


def test_a_weak_spot_among_thirteen_parameters_is_found(monkeypatch):
    monkeypatch.setattr(worst_case_search, "bound_excursion", lambda study, found: 0.1)
    study: Any = MadeUp(spot=0.8)
    found = search("sensitive_ten_percent", Effort(screened=1024, generations=15)).run(study)
    stages = list(found["stages_bar"].values())
    assert stages == sorted(stages)
    assert found["scenario"] == "pumping"
    assert found["seed"] % 50 == 0
    assert 1.3 - found["excursion_bar"] < 0.01  # a tenth of each range from the spot
    assert stages[0] < 1.27  # which the hypercube alone did not find
    assert search("sensitive_ten_percent", Effort(screened=1024, generations=15)).run(study) == found


class Fused(Hysteresis):
    """Leaves the coil off for good once it has drawn more than 0.6 A: below 40 ohm it does."""

    def reset(self, n):
        super().reset(n)
        self.blown = np.zeros(n, dtype=bool)

    def act(self, observations):
        self.blown |= decode(observations, "I") > 0.6
        return np.where(self.blown, 0, super().act(observations))


def test_a_weakness_of_a_controller_is_found_on_the_valve():
    fused = Fused(open_below=-0.1, shut_above=0.0, shut_lookahead=0.03)
    study = Study(controllers={"c": fused}, plant=PLANT, scenario="steps", duration=0.7)
    found = search("ten_percent", Effort(screened=16, generations=2)).run(study)
    assert found["parameters"]["R"] < 40.2
    assert found["excursion_bar"] > 1.0
    assert found["scenario"] == "steps"
    each = {"scenario": ["steps"], "parameters": [found["parameters"]]}
    metrics, _ = study.run("c", [found["seed"]], {}, each)  # the one that is shown
    assert metrics.excursion_bar[0] == pytest.approx(found["excursion_bar"], abs=1e-6)
    assert found["bound_bar"] < 0.5  # a better controller holds the band there


def test_a_search_alone_writes_its_table(tmp_path):
    """No point is run, so the other tables are empty."""
    short = ("--screened", "8", "--generations", "1", "--duration", "0.6", "--workers", "1")
    asked = ("--designs", "worst", "--controllers", "hysteresis, extrapolating")
    assert main([*asked, *short, "--out", str(tmp_path)]) == 0
    worst = json.loads((tmp_path / "results.json").read_text())["worst"]
    assert [each["region"] for each in worst] == ["confidence", "sensitive_ten_percent"]
    assert all(each["bound_bar"] > 0 for each in worst)
