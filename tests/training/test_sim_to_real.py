"""Simulated against measured: no gap without an effect, a gap with one, and the loop closes it."""

import json
import math

import pytest

pytest.importorskip("stable_baselines3")

from controllers.hysteresis import Hysteresis
from epv_env.common.commands import main_of
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant, save_plant
from epv_env.plant.region import Region
from training.evaluation.scenarios import EVALUATION
from training.studies.comparison import compare
from training.studies.sim_to_real import (
    AFTER,
    AROUND,
    BEFORE,
    GAPS,
    ITSELF,
    MEASURED,
    SIMULATED,
    diagnosis_text,
    gap_table,
    performance_figure,
    performance_table,
    short_table,
)

pytestmark = pytest.mark.training

CONTROLLER = Hysteresis(open_below=-0.1, shut_above=0.0, shut_lookahead=0.03, name="hysteresis")


def plant(**effects):
    parameters = Parameters.calibrated().replace(**effects)
    return Plant(parameters=parameters, region=Region(centre=parameters))


def deployments(stage, **effects):
    """Simulated on the nominal plant, measured on one with the effects."""
    found = {}
    for place, own in ((SIMULATED, plant()), (MEASURED, plant(**effects))):
        results = compare(
            {"hysteresis": CONTROLLER}, plant=own, scenarios={"steps": EVALUATION["steps"]}, episodes=12,
            duration=2.0, plant_sets=(ITSELF, AROUND),
        )  # fmt: skip
        found |= {(stage, place, plants, label): m for (plants, _, label), m in results.items()}
    return found


@pytest.fixture(scope="module")
def late():
    return deployments(BEFORE, t_delay=0.008)


def test_a_bench_without_an_effect_measures_exactly_what_was_simulated():
    (row,) = gap_table(deployments(BEFORE)).to_dict("records")
    assert all(row[name] == 0.0 for name in GAPS)


def test_a_late_coil_gives_larger_excursions_than_simulated(late):
    (row,) = gap_table(late).to_dict("records")
    for name in ("C1_excursion_mbar", "C3_excursion_mbar"):
        assert 50 < row[f"{name}_low"] < row[name] < row[f"{name}_high"]


def test_the_table_and_the_picture_hold_both_stages(late):
    both = late | {(AFTER, *key[1:]): metrics for key, metrics in late.items()}
    performance = performance_table(both)
    shown = short_table(performance, gap_table(both))
    assert list(shown["stage"]) == [BEFORE, AFTER]
    measured = 100 * (~late[BEFORE, MEASURED, ITSELF, "hysteresis"].stayed).mean()
    assert shown["measured leaves [%]"].iloc[0] == f"{measured:.1f}"
    assert len(performance_figure(performance).axes) == 2


def run_loop(out, *more):
    words = ["--quick", "--episodes", "4", "--out", str(out), *more]
    return main_of("training.commands.sim_to_real", program="sim-to-real", arguments=words)


FOUND = {
    "verdict": "known",
    "causes": [
        {"effects": ["command_delay"], "probability": 1.0, "magnitude": {"t_delay_s": [8e-3] * 3}}
    ],
    "ambiguity_set": [["command_delay"]],
    "gap": {},
}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A short loop whose diagnosis is there already, and right."""
    out = tmp_path_factory.mktemp("sim-to-real")
    (out / "diagnosis").mkdir()
    (out / "diagnosis" / "gap.json").write_text(json.dumps(FOUND))
    save_plant(plant(t_delay=0.008), out / "diagnosis" / "plant.json")
    assert run_loop(out, "--effect", "command_delay=0.008") == 0
    return out


def test_retraining_on_the_true_plant_leaves_nothing_between_simulated_and_measured(finished):
    rows = json.loads((finished / "sim-to-real.json").read_text())["gaps"]
    gap = {(row["controller"], row["stage"]): row["C1_excursion_mbar"] for row in rows}
    assert gap["hysteresis, extrapolating", BEFORE] > 50
    assert all(gap[name, stage] == 0.0 for name, stage in gap if stage == AFTER)


def test_what_is_finished_is_kept(finished):
    def times():
        names = ("policy.safetensors", "simulated.jsonl", "campaign.json", "gap.json")
        return {p: p.stat().st_mtime_ns for p in finished.rglob("*") if p.name in names}

    before = times()
    assert len(before) >= 6
    assert run_loop(finished, "--effect", "command_delay=0.008") == 0
    assert times() == before


def test_a_plant_without_a_named_cause_is_said_to_be_recalibrated_only():
    assert "command_delay" in diagnosis_text(FOUND, "an effect")
    assert diagnosis_text({**FOUND, "ambiguity_set": []}, "an effect").endswith("recalibrated only.")


def test_another_effect_in_the_same_folder_is_refused(finished, capsys):
    assert run_loop(finished, "--effect", "seat_leak=1e-7") == 2
    assert "holds a sim-to-real run with effect command_delay=0.008, not" in capsys.readouterr().err


def test_an_unknown_effect_is_refused_before_anything_is_written(tmp_path, capsys):
    assert run_loop(tmp_path, "--effect", "gremlins=3") == 2
    assert "unknown effect" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_the_diagnosis_finds_what_was_withheld_and_closes_the_gap(tmp_path):
    assert run_loop(tmp_path, "--effect", "command_delay=0.006") == 0
    content = json.loads((tmp_path / "sim-to-real.json").read_text())
    assert content["diagnosis"]["ambiguity_set"] == [["command_delay"]]
    found = content["diagnosis"]["causes"][0]["magnitude"]["t_delay_s"][0]
    assert math.isclose(found, 0.006, rel_tol=0.01)
    gap = {(row["controller"], row["stage"]): row["C1_excursion_mbar"] for row in content["gaps"]}
    name = "hysteresis, extrapolating"
    assert abs(gap[name, AFTER]) < 0.1 * abs(gap[name, BEFORE])
