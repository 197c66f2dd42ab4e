"""A plant file may describe any valve of this kind; statics refuses one that could not work."""

import json
from pathlib import Path

import numpy as np
import pytest

from epv_env.plant.force_balance import opening_force, pull_in_force, venting_rate
from epv_env.plant.parameters import ParameterError, Parameters
from epv_env.plant.plantfile import PlantFileError, load_plant, save_plant
from epv_env.plant.region import Region

HALF_SIZE = Path(__file__).parents[2] / "docs/examples/half_size/half-size.json"
CONTENT = json.loads(HALF_SIZE.read_text())


def changed(tmp_path, **fields):
    """The path of the half-size valve's file with fields of its objects replaced."""
    content = {
        name: {**value, **fields.pop(name, {})} if isinstance(value, dict) else fields.pop(name, value)
        for name, value in CONTENT.items()
    }
    path = tmp_path / "plant.json"
    path.write_text(json.dumps({**content, **fields}))
    return path


def test_the_half_size_valve_survives_a_round_trip(tmp_path):
    plant = load_plant(HALF_SIZE)
    save_plant(plant, tmp_path / "plant.json")
    again = load_plant(tmp_path / "plant.json")
    assert dict(again.parameters) == dict(plant.parameters)
    assert again.parameters.own_domains == plant.parameters.own_domains
    assert (again.voltage, again.sensors, again.free) == (plant.voltage, plant.sensors, plant.free)


def test_its_own_domains_bound_its_values_and_regions():
    centre = load_plant(HALF_SIZE).parameters
    assert centre.replace(R=13.0)["R"] == 13.0
    assert centre.replace(R=13.0).replace(R=11.0)["R"] == 11.0
    with pytest.raises(ParameterError, match=r"R = 42 Ohm is outside its domain \[10.5, 14\] \(the pl"):
        centre.replace(R=42.0)
    with pytest.raises(ParameterError, match=r"give .* or for another valve its own domain in a plant"):
        Parameters.calibrated().replace(R=12.0)
    for name in ("ten_percent", "sensitive_ten_percent", "domain"):
        region = Region.named(name, centre)
        drawn = region.draw(np.random.default_rng(0))
        assert drawn.own_domains == centre.own_domains
        for symbol, ends in region.boxes.items():
            low, high = centre.domain(symbol)
            assert low <= ends[0] <= drawn[symbol] <= ends[1] <= high


def test_the_force_balance_holds_at_its_edge():
    p = Parameters.calibrated()
    area = np.pi / 4 * (p["d1"] ** 2 - p["d2"] ** 2)
    opens = p["p_env"] + p["cPV"] * p["xPV0"] / area
    assert opening_force(p, opens) == pytest.approx(0.0, abs=1e-9)
    assert pull_in_force(p, 0.0, 0.0) == pytest.approx(-p["cMV"] * p["xMV0"])
    assert pull_in_force(p, 0.0, p["xMVmax"]) == pytest.approx(-p["cMV"] * (p["xMV0"] + p["xMVmax"]))


def test_the_venting_rate_is_that_of_choked_flow():
    p = Parameters.calibrated()
    speed = np.sqrt(1.4 * p["R_gas"] * p["T_env"]) * (2 / 2.4) ** 3
    expected = p["alphaMV"] * np.pi / 4 * p["dMVexh"] ** 2 * speed / p["V3"]
    assert venting_rate(p) == pytest.approx(expected, rel=1e-6)


def with_domains(**given):
    """Fields for parameters of a value and a domain."""
    values = {symbol: value for symbol, (value, *_) in given.items()}
    return {"parameters": values, "domains": {symbol: ends for symbol, (_, *ends) in given.items()}}


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"domains": {"R": [14, 10]}}, r"domain \[14, 10\] Ohm of R .* give low < high inside"),
        ({"domains": {"V2": [10, 30]}}, r"V2 is none of a valve of this kind, .* in SI units"),
        ({"domains": {"kappa": [1.3, 1.5]}}, "kappa is a constant and has no domain: leave it out"),
        (with_domains(d1=(0.006, 5e-3, 9e-3), d2=(0.007, 5e-3, 9e-3)), "d2 = 0.007 m must be less than"),
        (with_domains(cPV=(5e4, 4e4, 6e4)), r"the piston never opens: .* check their units"),
        (with_domains(N=(100, 90, 650)), r"12 V and 1 A leave a net -.* N, so the coil .*: check N"),
        ({"voltage_V": 24}, r"voltage_V = 24 must be positive and within the voltage sensor's range"),
        ({"sensors": {"I": {"high": 0.9}}}, r"voltage_V / R = 1 A exceeds the current sensor's range"),
        ({"sensors": {"p1": {"high": 1.5}}}, r"sensors.p1.high = 1.5 bar lies below 1.89 bar"),
        ({"sensors": {"p9": {}}}, "sensors: unknown channel 'p9': known are"),
        ({"sensors": {"p1": {"low": -1}}}, "sensors.p1.low = -1 bar lies below vacuum"),
        ({"sensors": {"p1": {"noise": 0}}}, "sensors.p1.noise = 0 bar must be positive"),
        ({"free": {"T_env": {}}}, "free.T_env cannot be calibrated: choose from .*alphaMV"),
        ({"free": {"R": {"bounds": [1, 14]}}}, r"free.R.bounds \[1, 14\] must lie in the domain"),
        ({"free": {"R": {"bounds": [13, 14]}}}, "do not hold the start, parameters.R = 12"),
        ({"free": {"R": {"mean": 12}}}, "free.R has one of mean and sd: give both or none"),
        ({"free": {"R": {"mean": 20, "sd": 1}}}, "free.R has mean 20 and sd 1: give a mean within"),
        ({"free": {"a1": {}}}, "free.a1 starts at 0"),
    ],
    ids=lambda value: None if isinstance(value, dict) else value[:40],
)
def test_what_could_be_no_valve_is_refused_in_a_sentence(tmp_path, fields, message):
    with pytest.raises(PlantFileError, match=message) as refusal:
        load_plant(changed(tmp_path, **fields))
    assert "\n" not in str(refusal.value)
    assert str(tmp_path / "plant.json") in str(refusal.value)
