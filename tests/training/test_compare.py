"""Comparisons are fair, repeatable, resumable, and can tell a good controller from a bad one."""

import json
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("pandas")
pytest.importorskip("joblib")

from controllers.hysteresis import Hysteresis
from epv_env.common.commands import main_of
from epv_env.common.files import Journal
from epv_env.plant.plantfile import Plant, save_plant
from training.evaluation import batches
from training.evaluation.batches import Batch, in_batches, run_batches
from training.evaluation.rollout import run_episodes
from training.evaluation.scenarios import EVALUATION
from training.studies.comparison import PLANTS, as_text, compare, differences, rows

pytestmark = pytest.mark.training

PLANT = Plant.calibrated()
GOOD = Hysteresis(open_below=-0.1, shut_above=0.0, shut_lookahead=0.03, name="good")
LATE = Hysteresis(open_below=-0.4, shut_above=0.4, name="late")
STEPS = {"steps": EVALUATION["steps"]}


class Recorder(Hysteresis):
    """Notes when it is reset: (valves, decisions so far)."""

    def __init__(self) -> None:
        super().__init__(open_below=-0.1, shut_above=0.0)
        self.decisions, self.resets = 0, []

    def reset(self, n):
        self.resets.append((n, self.decisions))
        super().reset(n)

    def act(self, observations):
        self.decisions += 1
        return super().act(observations)


@pytest.fixture(scope="module")
def results():
    return compare({"good": GOOD, "late": LATE}, plant=PLANT, scenarios=STEPS, episodes=24, duration=3.0)


def test_a_restart_makes_the_controller_forget_once_at_its_time():
    controller = Recorder()
    run_episodes(controller, seeds=[1, 2], duration=0.1, options={}, restart_s=0.05)
    assert controller.resets == [(2, 0), (2, 10)]


def test_batches_hold_the_episodes_of_one_run(monkeypatch):
    options = {"plant": PLANT, "scenario": "steps"}
    whole = Batch(name="w", controller="good", first_seed=5, episodes=5, duration=0.8, options=options)
    (at_once,) = run_batches([whole], {"good": GOOD}, what="test")
    monkeypatch.setattr(batches, "BATCH_EPISODES", 2)
    assert [part.episodes for part in in_batches(whole)] == [2, 2, 1]
    (in_parts,) = run_batches([whole], {"good": GOOD}, what="test")
    np.testing.assert_array_equal(in_parts.excursion_bar, at_once.excursion_bar)
    alone = run_episodes(GOOD, seeds=[7], duration=0.8, options=options)
    assert in_parts.excursion_bar[2] == alone.excursion_bar[0]


def test_what_is_in_the_journal_is_not_run_again(tmp_path):
    batch = Batch(
        name="b", controller="good", first_seed=5, episodes=2, duration=0.6, options={"plant": PLANT}
    )
    (first,) = run_batches([batch], {"good": GOOD}, journal=Journal(tmp_path / "j", {}), what="test")
    (again,) = run_batches([batch], {}, journal=Journal(tmp_path / "j", {}), what="test")
    for name in ("stayed", "excursion_bar", "episode_return"):
        np.testing.assert_array_equal(getattr(again, name), getattr(first, name))


def test_the_comparison_separates_good_from_late(results):
    table = rows(results).set_index(["plants", "controller"])
    for plants in PLANTS:
        good, late = table.loc[(plants, "good")], table.loc[(plants, "late")]
        assert good["left_percent"] < late["left_percent"]
        assert good["left_low"] <= good["left_percent"] <= good["left_high"]
        assert good["rms_error_bar"] < late["rms_error_bar"]
    assert "late" in as_text(rows(results))


def test_differences_are_paired_and_have_a_sign(results):
    table = differences(results, "late").set_index(["plants", "score"])
    row = table.loc[("calibrated", "rms error [mbar]")]
    both = [results["calibrated", "steps", name].rms_bar for name in ("good", "late")]
    assert row["difference"] == pytest.approx(1e3 * np.mean(both[0] - both[1]))
    assert row["low"] < row["difference"] < row["high"] < 0
    assert table.loc[("calibrated", "violation rate [%]"), "difference"] < 0


def command(*arguments):
    words = [str(word) for word in arguments]
    return main_of("training.commands.compare", program="compare", arguments=["--quick", *words])


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    out = tmp_path_factory.mktemp("comparison")
    chosen = ("--controllers", "hysteresis", "docs.examples.relay:Relay", "--scenarios", "restart")
    arguments = (*chosen, "--plants", "calibrated", "--episodes", 3, "--workers", 1, "--out", out)
    assert command(*arguments) == 0
    return out, arguments


def test_the_short_form_writes_everything(finished):
    out, _ = finished
    assert {path.name for path in out.iterdir()} == {
        "comparison.csv", "differences.csv", "results.json", "comparison.png", "finished.jsonl",
    }  # fmt: skip
    content = json.loads((out / "results.json").read_text())
    assert [row["controller"] for row in content["rows"]] == ["hysteresis", "relay"]
    assert all(row["decision_us"] > 0 for row in content["rows"])
    left = content["rows"][0]["left_seeds"]
    assert len(left) == round(content["rows"][0]["left_percent"] / 100 * 3)


def test_a_stopped_comparison_goes_on_where_it_stopped(finished):
    out, arguments = finished
    journal, table = out / "finished.jsonl", (out / "comparison.csv").read_text()
    lines = journal.read_text().splitlines(keepends=True)
    journal.write_text("".join(lines[:2]) + lines[2][:40])  # killed while it wrote a line
    assert command(*arguments) == 0
    assert journal.read_text().splitlines()[:2] == [line.rstrip() for line in lines[:2]]
    assert len(journal.read_text().splitlines()) == len(lines)
    columns = [line.rsplit(",", 1)[0] for line in (out / "comparison.csv").read_text().splitlines()]
    assert columns == [line.rsplit(",", 1)[0] for line in table.splitlines()]  # the last are times


def test_a_plant_of_another_voltage_is_refused_in_the_folder_of_the_first(tmp_path, capsys):
    chosen = ("--controllers", "hysteresis", "--plants", "calibrated", "--episodes", 2, "--workers", 1)
    plant, out, before = tmp_path / "plant.json", tmp_path / "out", b""
    for voltage, status in ((24.0, 0), (18.0, 2)):
        save_plant(replace(PLANT, voltage=voltage), plant)
        assert command(*chosen, "--plant", plant, "--out", out) == status
        before = before or (out / "finished.jsonl").read_bytes()
    assert (out / "finished.jsonl").read_bytes() == before
    assert "holds results with plant.voltage_V 24.0, not 18.0: go on with" in capsys.readouterr().err
