"""A plant file gives back what was written, is written whole or not at all, and refuses the rest."""

import json
from dataclasses import replace

import numpy as np
import pytest

from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import FORMAT, Plant, PlantFileError, load_plant, plant_subject, save_plant
from epv_env.plant.region import Alternative, Mixture, Region

CENTRE = Parameters.calibrated().replace(alphaMV=0.75, R=41.123456789012345)
JOINT = Plant(
    parameters=CENTRE,
    region=Region(
        centre=CENTRE,
        boxes={"kPV": (9.0, 11.0)},
        symbols=("alphaMV", "R"),
        covariance=np.array([[1e-4, 1e-3 / 3], [1e-3 / 3, 0.1]]),
        chi_square=5.99,
    ),
    name="bench 7",
    provenance={"recordings": ["a.csv"], "residual_mbar": 1 / 3},
)
SHIFTED = replace(JOINT.region, centre=CENTRE.replace(eMV=0.5, R=42.0))
MIXED = replace(
    JOINT,
    diagnosis=Mixture(
        alternatives=(
            Alternative(name="armature_bounce", probability=2 / 3, region=SHIFTED),
            Alternative(name="recalibrated", probability=1 / 3, region=JOINT.region),
        )
    ),
)


def written(path, **content):
    """A plant file with some content."""
    path.write_text(json.dumps({"format": FORMAT, "parameters": {}} | content))
    return path


@pytest.mark.parametrize(
    "change",
    [
        {"voltage_V": 18.0},
        {"sensors": {"p2": {"noise": 0.01}}},
        {"effects": {"command_delay": {"t_delay": 1e-3}}},
        {"parameters": {"R": 41.0}},
        {"region": {"boxes": {"R": [40.0, 44.0]}}},
        {"free": {"R": {"mean": 42.0, "sd": 1.0}}},
    ],
)
def test_results_of_another_plant_have_another_subject(change, tmp_path):
    """It is all that the file says, but where its values come from."""
    first, same, other = (
        json.dumps(plant_subject(load_plant(written(tmp_path / "plant.json", **content))))
        for content in ({}, {"provenance": {"seed": 1}}, change)
    )
    assert first == same
    assert first != other


def test_a_subject_is_as_its_file_gives_it_back(tmp_path):
    """So that what a folder was begun with can be compared with what is given now."""
    freedom = {"R": {"bounds": [40.0, 44.0]}, "RML": {"mean": 1.7e7, "sd": 1e5}}
    plant = load_plant(written(tmp_path / "plant.json", free=freedom))
    subject = plant_subject(plant)
    assert json.loads(json.dumps(subject)) == subject
    assert subject["plant"]["free"] == freedom


def assert_equal(found, expected):
    assert dict(found.parameters) == dict(expected.parameters)
    assert (found.name, found.provenance) == (expected.name, expected.provenance)
    assert [(each.name, each.probability) for each in alternatives(found)] == [
        (each.name, each.probability) for each in alternatives(expected)
    ]
    assert_equal_regions(found.region, expected.region)
    for own, other in zip(alternatives(found), alternatives(expected), strict=True):
        assert_equal_regions(own.region, other.region)


def alternatives(plant):
    return plant.diagnosis.alternatives if plant.diagnosis else ()


def assert_equal_regions(found, expected):
    assert dict(found.centre) == dict(expected.centre)
    assert found.boxes == dict(expected.boxes)
    assert found.symbols == expected.symbols
    assert found.chi_square == expected.chi_square
    np.testing.assert_array_equal(found.covariance, expected.covariance)


@pytest.mark.parametrize(
    "plant", [Plant.calibrated(), JOINT, MIXED], ids=["calibrated", "joint", "alternatives"]
)
def test_reading_gives_back_what_was_written_to_the_bit(tmp_path, plant):
    save_plant(plant, tmp_path / "plant.json")
    assert_equal(load_plant(tmp_path / "plant.json"), plant)
    assert_equal(load_plant(str(tmp_path / "plant.json")), plant)


def test_parameters_left_out_are_the_report_s(tmp_path):
    plant = load_plant(written(tmp_path / "p.json", parameters={"R": 40}))
    assert dict(plant.parameters) == dict(Parameters.calibrated().replace(R=40))
    assert plant.region.boxes == {}


def test_what_json_cannot_hold_leaves_the_old_file(tmp_path):
    save_plant(JOINT, tmp_path / "plant.json")
    bad = Plant(parameters=CENTRE, region=JOINT.region, provenance={"x": object()})
    with pytest.raises(TypeError):
        save_plant(bad, tmp_path / "plant.json")
    assert load_plant(tmp_path / "plant.json").name == "bench 7"


JOINT_R = {"symbols": ["R"], "chi_square": 1}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"parameters": []}, "parameters must be an object of values by symbol"),
        ({"parameters": {"x": 1}}, "unknown parameter 'x': known symbols are"),
        ({"parameters": {"R": "x"}}, "parameter R is 'x': give one number"),
        ({"parameters": {"R": 99}}, "R = 99 Ohm is outside its domain"),
        ({"parameters": {"R": float("nan")}}, "R = nan Ohm is outside its domain"),
        ({"region": {"boxes": {"x": [1, 2]}}}, "unknown parameter 'x'"),
        ({"region": {"boxes": {"R": [42, 41]}}}, "range of R is"),
        ({"region": {"joint": {"symbols": ["R"]}}}, "field 'covariance' is missing"),
        ({"region": {"joint": {**JOINT_R, "covariance": [[-1]]}}}, "positive semi-definite 1 x 1"),
        ({"alternatives": [{"parameters": {}}]}, r"alternatives\[0\]: field 'probability' is missing"),
        ({"alternatives": [{"parameters": {}, "probability": 0.5}]}, "have the sum 0.5: make it 1"),
        (
            {"alternatives": [{"name": "a", "parameters": {"R": 99}, "probability": 1}]},
            "alternative 'a': parameter R = 99 Ohm is outside its domain",
        ),
    ],
    ids=str,
)
def test_bad_content_is_refused_with_the_file_s_name(tmp_path, content, message):
    path = written(tmp_path / "plant.json", **content)
    with pytest.raises(PlantFileError, match=rf"plant\.json: .*{message}"):
        load_plant(path)


def test_effects_travel_by_name(tmp_path):
    """What is switched on stands under its effect's name, and comes back; what is off is left out."""
    parameters = Parameters.calibrated().replace(a2=1e-4, eMV=0.5)
    save_plant(Plant(parameters=parameters, region=Region(centre=parameters)), tmp_path / "p.json")
    content = json.loads((tmp_path / "p.json").read_text())
    assert content["effects"] == {
        "armature_bounce": {"eMV": 0.5},
        "local_gas_speed": {"a1": 0.0, "a2": 1e-4},
    }
    assert dict(load_plant(tmp_path / "p.json").parameters) == dict(parameters)
