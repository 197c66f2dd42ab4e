"""Simulated against measured: no gap without an effect, a gap with one, and the loop closes it."""

import json
import math

import pytest

pytest.importorskip("stable_baselines3")

import pandas as pd

from controllers.hysteresis import Hysteresis
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant, save_plant
from epv_env.plant.region import Region
from training.sim_to_real import main
from training.studies.sim_to_real.deployment import (
    AFTER,
    AROUND,
    BEFORE,
    ITSELF,
    MEASURED,
    SIMULATED,
    deployed,
    read_episodes,
)
from training.studies.sim_to_real.performance_figure import performance_figure
from training.studies.sim_to_real.performance_tables import (
    FIGURES,
    GAPS,
    as_markdown,
    gap_table,
    performance_table,
)
from training.studies.sim_to_real.sim_to_real_report import diagnosis_text

pytestmark = pytest.mark.training

CONTROLLER = Hysteresis(open_below=-0.1, shut_above=0.0, shut_lookahead=0.03, name="hysteresis")


def plant(**effects):
    parameters = Parameters.calibrated().replace(**effects)
    return Plant(parameters=parameters, region=Region(centre=parameters))


def episodes(stage, **effects):
    """Simulated on the nominal plant, measured on one with the effects."""
    plants = {SIMULATED: plant(), MEASURED: plant(**effects)}
    found = deployed(
        [CONTROLLER], plants, scenario="steps", count=12, duration=2.0, what="test"
    )  # fmt: skip
    return found.assign(stage=stage)


@pytest.fixture(scope="module")
def late():
    return episodes(BEFORE, t_delay=0.008)


def test_a_bench_without_an_effect_measures_exactly_what_was_simulated():
    found = gap_table(episodes(BEFORE))
    assert len(found) == 1
    assert all(found.loc[0, name] == 0.0 for name in GAPS)


def test_a_late_coil_gives_larger_excursions_than_simulated(late):
    found = gap_table(late).loc[0]
    for name in ("C1_excursion", "C3_excursion"):
        assert found[f"{name}_low_bar"] > 0.05
        assert found[f"{name}_low_bar"] < found[f"{name}_bar"] < found[f"{name}_high_bar"]


def test_c1_and_c2_are_judged_on_the_valve_itself_and_c3_around_it(late):
    found = performance_table(late).set_index("place")
    for place in (SIMULATED, MEASURED):
        of = {s: late[(late["place"] == place) & (late["plants"] == s)] for s in (ITSELF, AROUND)}
        assert found.loc[place, "C1_stayed"] == of[ITSELF]["stayed"].mean()
        assert found.loc[place, "C3_stayed"] == of[AROUND]["stayed"].mean()
        assert found.loc[place, "C3_worst_excursion_bar"] == of[AROUND]["excursion_bar"].max()
        assert found.loc[place, "C1_stayed_low"] <= found.loc[place, "C1_stayed"]


def test_the_table_names_every_figure_and_the_picture_has_every_aim(late):
    both = pd.concat([late, late.assign(stage=AFTER)])
    aims = performance_table(both)
    text = as_markdown(aims, gap_table(both))
    assert all(heading in text for _, _, heading in FIGURES.values())
    labels = " ".join(axes.get_ylabel() for axes in performance_figure(aims).axes)
    assert all(aim in labels for aim in ("C1", "C2", "C3"))


def run_loop(out, *more):
    return main(["--quick", "--episodes", "4", "--out", str(out), *more])


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
    gap = {(row["controller"], row["stage"]): row["C1_excursion_bar"] for row in rows}
    assert gap["hysteresis, extrapolating", BEFORE] > 0.05
    assert all(gap[name, stage] == 0.0 for name, stage in gap if stage == AFTER)


def test_what_is_finished_is_kept(finished):
    def times():
        return {
            path: path.stat().st_mtime_ns
            for path in finished.rglob("*")
            if path.name in ("policy.safetensors", "episodes.csv", "campaign.json", "gap.json")
        }

    before = times()
    assert len(before) == 6
    assert run_loop(finished, "--effect", "command_delay=0.008") == 0
    assert times() == before


def test_a_plant_without_a_named_cause_is_said_to_be_recalibrated_only():
    assert "command_delay" in diagnosis_text(FOUND, "an effect")
    assert diagnosis_text({**FOUND, "ambiguity_set": []}, "an effect").endswith("recalibrated only.")


def test_another_effect_in_the_same_folder_is_refused(finished):
    with pytest.raises(
        ValueError, match=r"holds a sim-to-real run with effect command_delay=.*, not seat_leak"
    ):
        run_loop(finished, "--effect", "seat_leak=1e-7")


def test_a_folder_whose_options_are_damaged_is_refused(tmp_path):
    (tmp_path / "config.json").write_text('{"effect": ')
    with pytest.raises(ValueError, match=r"config.json is not JSON .* choose another --out"):
        main(["--quick", "--out", str(tmp_path)])
    assert [path.name for path in tmp_path.iterdir()] == ["config.json"]


def test_episodes_are_read_back_but_not_those_of_another_version(late, tmp_path):
    path = tmp_path / "episodes.csv"
    late.to_csv(path, index=False)
    pd.testing.assert_frame_equal(read_episodes(path), late)
    late.drop(columns="rms_bar").to_csv(path, index=False)
    with pytest.raises(ValueError, match="has no column rms_bar: another version"):
        read_episodes(path)


def test_an_unknown_effect_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(ValueError, match="unknown effect"):
        run_loop(tmp_path, "--effect", "gremlins=3")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_the_diagnosis_finds_what_was_withheld_and_closes_the_gap(tmp_path):
    assert run_loop(tmp_path, "--effect", "command_delay=0.006") == 0
    content = json.loads((tmp_path / "sim-to-real.json").read_text())
    assert content["diagnosis"]["ambiguity_set"] == [["command_delay"]]
    found = content["diagnosis"]["causes"][0]["magnitude"]["t_delay_s"][0]
    assert math.isclose(found, 0.006, rel_tol=0.01)
    gap = {(row["controller"], row["stage"]): row["C1_excursion_bar"] for row in content["gaps"]}
    name = "hysteresis, extrapolating"
    assert abs(gap[name, AFTER]) < 0.1 * abs(gap[name, BEFORE])
