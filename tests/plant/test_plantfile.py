"""A plant file gives back what was written, is written whole or not at all, and refuses the rest."""

import json
import os

import numpy as np
import pytest

from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import FORMAT, Plant, PlantFileError, load_plant, save_plant
from epv_env.plant.region import Region

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


def written(path, **content):
    """A plant file with some content."""
    path.write_text(json.dumps({"format": FORMAT, "parameters": {}} | content))
    return path


def assert_equal(found, expected):
    assert dict(found.parameters) == dict(expected.parameters)
    assert (found.name, found.provenance) == (expected.name, expected.provenance)
    assert dict(found.region.centre) == dict(expected.parameters)
    assert found.region.boxes == dict(expected.region.boxes)
    assert found.region.symbols == expected.region.symbols
    assert found.region.chi_square == expected.region.chi_square
    np.testing.assert_array_equal(found.region.covariance, expected.region.covariance)


@pytest.mark.parametrize("plant", [Plant.calibrated(), JOINT], ids=["calibrated", "joint"])
def test_reading_gives_back_what_was_written_to_the_bit(tmp_path, plant):
    save_plant(plant, tmp_path / "plant.json")
    assert_equal(load_plant(tmp_path / "plant.json"), plant)
    assert_equal(load_plant(str(tmp_path / "plant.json")), plant)


def test_a_joint_region_draws_the_same_after_a_round_trip(tmp_path):
    save_plant(JOINT, tmp_path / "plant.json")
    found = load_plant(tmp_path / "plant.json").region.draw(np.random.default_rng(0))
    assert dict(found) == dict(JOINT.region.draw(np.random.default_rng(0)))


def test_without_a_file_it_is_the_report_s_calibration():
    assert dict(load_plant(None).parameters) == dict(Parameters.calibrated())
    assert load_plant(JOINT) is JOINT


def test_parameters_left_out_are_the_report_s(tmp_path):
    plant = load_plant(written(tmp_path / "p.json", parameters={"R": 40}))
    assert dict(plant.parameters) == dict(Parameters.calibrated().replace(R=40))
    assert plant.region.boxes == {}


def test_a_missing_folder_is_made(tmp_path):
    save_plant(JOINT, tmp_path / "a" / "b" / "plant.json")
    assert load_plant(tmp_path / "a" / "b" / "plant.json").name == "bench 7"


@pytest.mark.parametrize("failing", ["replace", "fdopen"])
def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch, failing):
    path = tmp_path / "plant.json"
    save_plant(JOINT, path)
    before = path.read_bytes()

    def fail(*args, **kwargs):
        raise OSError("disk full")

    monkeypatch.setattr(os, failing, fail)
    with pytest.raises(OSError, match="disk full"):
        save_plant(Plant.calibrated(), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_what_json_cannot_hold_leaves_the_old_file(tmp_path):
    save_plant(JOINT, tmp_path / "plant.json")
    bad = Plant(parameters=CENTRE, region=JOINT.region, provenance={"x": object()})
    with pytest.raises(TypeError):
        save_plant(bad, tmp_path / "plant.json")
    assert load_plant(tmp_path / "plant.json").name == "bench 7"


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(PlantFileError, match=r"cannot read plant file .*no\.json .No such file"):
        load_plant(tmp_path / "no.json")


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"{'format': 1}"])
def test_what_is_not_json_is_refused(tmp_path, content):
    path = tmp_path / "plant.json"
    path.write_bytes(content)
    with pytest.raises(PlantFileError, match=r"plant\.json is not JSON .*, or write it anew"):
        load_plant(path)


@pytest.mark.parametrize("content", [[], 7, {}, {"format": "epv-plant/0"}, {"format": 1}], ids=str)
def test_another_format_is_refused(tmp_path, content):
    path = tmp_path / "plant.json"
    path.write_text(json.dumps(content))
    with pytest.raises(PlantFileError, match="this version reads 'epv-plant/1': write it anew"):
        load_plant(path)


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
        (
            {"region": {"joint": {"symbols": ["R"], "covariance": [[-1]], "chi_square": 1}}},
            "positive semi-definite 1 x 1",
        ),
    ],
    ids=str,
)
def test_bad_content_is_refused_with_the_file_s_name(tmp_path, content, message):
    path = written(tmp_path / "plant.json", **content)
    with pytest.raises(PlantFileError, match=rf"plant\.json: .*{message}"):
        load_plant(path)


def test_missing_parameters_are_refused(tmp_path):
    (tmp_path / "plant.json").write_text(json.dumps({"format": FORMAT}))
    with pytest.raises(PlantFileError, match="field 'parameters' is missing"):
        load_plant(tmp_path / "plant.json")


@pytest.mark.parametrize(
    ("region", "message"),
    [
        (None, "is not of the form that docs/reference/files.md describes"),
        ([], "is not of the form that docs/reference/files.md describes"),
        ({"boxes": []}, "is not of the form that docs/reference/files.md describes"),
        ({"boxes": {"R": 40}}, "is not of the form that docs/reference/files.md describes"),
        (
            {"joint": {"symbols": ["x"], "covariance": [[1]], "chi_square": 1}},
            "unknown parameter 'x'",
        ),
    ],
    ids=str,
)
def test_a_region_of_the_wrong_form_is_refused(tmp_path, region, message):
    with pytest.raises(PlantFileError, match=rf"plant\.json.* {message}"):
        load_plant(written(tmp_path / "plant.json", region=region))


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


def test_an_unknown_effect_is_refused(tmp_path):
    content = {"format": "epv-plant/1", "parameters": {}, "effects": {"gremlins": {"eMV": 0.5}}}
    (tmp_path / "p.json").write_text(json.dumps(content))
    with pytest.raises(PlantFileError, match=r"unknown effect 'gremlins': known are .*armature_bounce"):
        load_plant(tmp_path / "p.json")
