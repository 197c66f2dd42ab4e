"""Simulated against measured: no gap without an effect, a gap with one, and the loop closes it."""

import json
import math
import os
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("stable_baselines3")

from controllers.hysteresis import Hysteresis
from controllers.policy_files import policy_digest
from epv_env.common.commands import main_of
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant
from epv_env.plant.region import Region
from identification.commands import bench
from identification.recordings.campaign_files import read_campaign
from training.commands import sim_to_real
from training.commands.sim_to_real import MEASURED, SIMULATED, gap_table, trained
from training.evaluation.scenarios import EVALUATION
from training.studies.comparison import SCORES, compare

pytestmark = pytest.mark.training

CONTROLLER = Hysteresis(open_below=-0.1, shut_above=0.0, shut_lookahead=0.03, name="hysteresis")


def plant(**effects):
    parameters = Parameters.calibrated().replace(**effects)
    return Plant(parameters=parameters, region=Region(centre=parameters))


def deployments(**effects):
    """Simulated on the nominal plant, measured on one with the effects."""
    found = {}
    for place, own in ((SIMULATED, plant()), (MEASURED, plant(**effects))):
        found |= compare(
            {"hysteresis": CONTROLLER}, plant=own, episodes=12, duration=2.0,
            scenarios={f"before, {place}": EVALUATION["steps"]},
            plant_sets=("calibrated", "ten_percent"),
        )  # fmt: skip
    return found


def test_a_bench_without_an_effect_measures_exactly_what_was_simulated():
    gaps = gap_table(deployments())
    assert len(gaps) == 2 * len(SCORES)
    assert (gaps[["difference", "low", "high"]] == 0.0).to_numpy().all()


def test_a_late_coil_gives_larger_errors_than_simulated():
    gaps = gap_table(deployments(t_delay=0.008))
    errors: Any = gaps[gaps["score"] == "rms error [mbar]"]
    assert list(errors["plants"]) == ["calibrated", "ten_percent"]
    assert (errors["low"] > 10).all()
    assert (errors["low"] < errors["difference"]).all()
    assert (errors["difference"] < errors["high"]).all()


def run_loop(out, *more):
    words = ["--quick", "--episodes", "4", "--out", str(out), *more]
    return main_of("training.commands.sim_to_real", program="sim-to-real", arguments=words)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A short loop."""
    out = tmp_path_factory.mktemp("sim-to-real")
    assert run_loop(out, "--effect", "command_delay=0.006") == 0
    return out


def errors(out):
    """Measured minus simulated rms error on the valve itself, by controller and stage."""
    gaps = json.loads((out / "sim-to-real.json").read_text())["gaps"]
    return {
        (row["controller"], row["stage"]): row["difference"]
        for row in gaps
        if (row["plants"], row["score"]) == ("calibrated", "rms error [mbar]")
    }


def test_the_diagnosis_finds_what_was_withheld_and_closes_the_gap(finished):
    content = json.loads((finished / "sim-to-real.json").read_text())
    assert content["diagnosis"]["ambiguity_set"] == [["command_delay"]]
    found = content["diagnosis"]["causes"][0]["magnitude"]["t_delay_s"][0]
    assert math.isclose(found, 0.006, rel_tol=0.01)
    gap = errors(finished)
    name = "extrapolating hysteresis"
    assert abs(gap[name, "after"]) < 0.1 * abs(gap[name, "before"])


def test_what_is_finished_is_kept(finished):
    def times():
        names = ("policy.safetensors", "deployments.jsonl", "campaign.json", "gap.json")
        return {p: p.stat().st_mtime_ns for p in finished.rglob("*") if p.name in names}

    before = times()
    assert len(before) >= 6
    assert run_loop(finished, "--effect", "command_delay=0.006") == 0
    assert times() == before


@pytest.mark.parametrize(
    ("file", "field", "words"),
    [("diagnosis/plant.json", "provenance", "is no diagnosis of"),
     ("withheld/plant.json", "effects", "is not the valve with command_delay=0.006")],
)  # fmt: skip
def test_what_was_edited_is_no_step_of_this_loop(finished, file, field, words, capsys):
    kept = (finished / file).read_text()
    content = json.loads(kept)
    content[field].clear()
    (finished / file).write_text(json.dumps(content))
    assert run_loop(finished, "--effect", "command_delay=0.006") == 2
    assert words in capsys.readouterr().err
    (finished / file).write_text(kept)


@pytest.mark.parametrize("last", ["plant.json", "campaign.json"])
def test_a_bench_that_was_killed_between_its_files_records_anew(last, tmp_path, monkeypatch):
    replace = os.replace

    def killed(source, target):
        replace(source, target)
        if Path(target).name == last:
            raise KeyboardInterrupt

    def stopped(*_):
        raise KeyboardInterrupt

    for owner, name, value in ((os, "replace", killed), (sim_to_real, "deployed", stopped)):
        with monkeypatch.context() as patch:
            patch.setattr(owner, name, value)
            with pytest.raises(KeyboardInterrupt):
                run_loop(tmp_path)
    assert (tmp_path / "withheld" / "plant.json").exists()
    assert len(read_campaign(tmp_path / "campaign").recordings) == 6


def test_another_effect_is_refused_wherever_the_first_was_stopped(tmp_path, monkeypatch, capsys):
    record = bench.run

    def stopped(options):
        record(options)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(bench, "run", stopped)
        with pytest.raises(KeyboardInterrupt):
            run_loop(tmp_path, "--effect", "command_delay=0.008")
    assert run_loop(tmp_path, "--effect", "seat_leak=1e-7") == 2
    assert "holds a sim-to-real run with effect command_delay=0.008, not" in capsys.readouterr().err


def test_deployments_belong_to_both_valves_and_the_policy(finished):
    header, *lines = (finished / "after" / "deployments.jsonl").read_text().splitlines()
    subject = json.loads(header)["subject"]
    assert subject[MEASURED]["plant"]["effects"] == {"command_delay": {"t_delay": 0.006, "w_delay": 0.0}}
    assert subject[SIMULATED]["plant"]["parameters"]
    digest = policy_digest(finished / "after")
    assert any(f"PPO {digest}" in json.loads(line)["name"] for line in lines)


def test_a_policy_of_another_plant_is_not_taken_up(finished):
    with pytest.raises(ValueError, match="holds a policy with plants"):
        trained(finished / "after", plant(t_delay=0.004), "exact", seed=0, timesteps=8192)
