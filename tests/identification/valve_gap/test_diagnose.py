"""`gap CAMPAIGN`: its files, what it does with damaged recordings, and taking up an interrupted run."""

import json
import re
from dataclasses import replace
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import epv_env  # noqa: F401 - registers EPValve-v0
from epv_env.plant.plantfile import Plant, load_plant
from identification.__main__ import main
from identification.recordings.campaign_files import read_campaign, write_campaign
from identification.recordings.recording import Campaign, CampaignError, Recording
from identification.valve_gap.diagnose import diagnose_campaign, possible_plants, subject
from identification.valve_gap.valve import Valve
from tests.identification.valve_gap.campaigns import MANY, all_but, campaign

NAMES = ("test1", "low_supply", "validation")


def damaged(change) -> Campaign:
    """The campaign with every recording changed."""
    whole = campaign(*NAMES)
    return replace(whole, recordings=tuple(change(recording) for recording in whole.recordings))


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("gap")
    write_campaign(campaign(*NAMES, G_eddy=4e-3), folder / "campaign")
    assert main(["gap", str(folder / "campaign"), "--out", str(folder / "out")]) == 0
    return folder


def test_the_command_names_the_effect_and_writes_its_files(diagnosed):
    found = json.loads((diagnosed / "out" / "gap.json").read_text())
    assert found["format"] == "epv-gap/4"
    assert found["verdict"] == "known"
    assert found["ambiguity_set"] == [["eddy_current"]]
    value, low, high = found["causes"][0]["magnitude"]["G_eddy_S"]
    assert low < 4e-3 < high
    assert value == pytest.approx(4e-3, rel=0.03)
    assert found["gap"]["with_cause"] < 1.05 < found["gap"]["recalibrated"]
    assert "<html" in (diagnosed / "out" / "report.html").read_text()


def test_finished_fits_belong_to_the_whole_plant_and_its_surroundings():
    """Not only to the parameters that are fitted."""
    plant, warm = Plant.calibrated(), replace(campaign(*NAMES), temperature=313.0)
    others = replace(plant, voltage=18.0), replace(plant, parameters=plant.parameters.replace(V2=2e-3))
    found = [Valve(campaign(*NAMES), each) for each in (plant, *others)]
    first, again, *rest = (subject(each, (), {}) for each in (found[0], *found, Valve(warm, plant)))
    assert first == again
    assert all(first != each for each in rest)


def test_its_report_has_words_for_equations_and_parameters(diagnosed):
    page = (diagnosed / "out" / "report.html").read_text()
    assert "voltage balance of the coil" in page
    assert "resistance of the solenoid (R)" in page
    assert "eddy current in the solenoid&#39;s iron (eddy_current)" in page
    assert not re.search(r"(?<![(\w])(eddy_current|parameter:)", page)


def test_its_plant_file_goes_into_the_environment(diagnosed):
    path = diagnosed / "out" / "plant.json"
    assert load_plant(path).parameters["G_eddy"] == pytest.approx(4e-3, rel=0.03)
    env = gymnasium.make("EPValve-v0", plant=str(path))
    env.reset(seed=0)
    observation, *_ = env.step(env.action_space.sample())
    assert np.all(np.isfinite(observation))


def test_the_plant_file_knows_how_sure_it_is(diagnosed):
    """Its region spreads the four and the size together; the bench's true plant is not far off."""
    region = load_plant(diagnosed / "out" / "plant.json").region
    assert region.symbols == ("alphaMV", "alphaPV", "RML", "R", "G_eddy")
    drawn = [region.draw(np.random.default_rng(seed)) for seed in range(50)]
    spread = np.std([plant["G_eddy"] for plant in drawn]) / 4e-3
    assert 0.02 < spread < 0.2
    gymnasium.make("EPValve-v0", plant=str(diagnosed / "out" / "plant.json"), parameters="confidence")


def test_the_plant_file_holds_what_is_possible_beside_the_first_answer(diagnosed):
    """Here little is: the alternatives together hold the eddy current nearly surely, at its size."""
    plant = load_plant(diagnosed / "out" / "plant.json")
    assert plant.diagnosis is not None
    first, *others = plant.diagnosis.alternatives
    assert "eddy_current" in first.name
    assert dict(first.region.centre) == dict(plant.parameters)
    assert first.probability > 0.9 > 0.1 > max((each.probability for each in others), default=0.0)


def test_possible_plants_hold_nearly_all_probability_no_cause_included(diagnosed):
    valve = Valve(read_campaign(diagnosed / "campaign"))
    found = diagnose_campaign(diagnosed / "campaign", diagnosed / "out", report=False)
    shares = [0.5, *[0.0] * (len(found.ranking.hypotheses) - 1)]
    doubtful = replace(
        found, ranking=replace(found.ranking, probabilities=shares, no_cause=0.3, unknown=0.2)
    )
    likely, unnamed = possible_plants(doubtful, valve).alternatives
    assert (likely.probability, unnamed.probability) == (0.5, 0.5)
    assert unnamed.name == "recalibrated"
    assert unnamed.region.centre["G_eddy"] == 0.0 < likely.region.centre["G_eddy"]


def flat(content, name: str = "") -> dict[str, object]:
    """The values of a JSON content by their places."""
    pairs = content.items() if isinstance(content, dict) else enumerate(content)
    found = {}
    for key, value in pairs:
        nested = isinstance(value, (dict, list))
        found |= flat(value, f"{name}/{key}") if nested else {f"{name}/{key}": value}
    return found


def test_finished_fits_are_taken_up_again(diagnosed, monkeypatch, tmp_path):
    first = json.loads((diagnosed / "out" / "gap.json").read_text())

    def never(*args, **options):
        raise AssertionError("a kept fit was run again")

    monkeypatch.setattr("identification.gap.fit.gauss_newton._Search", never)
    diagnose_campaign(diagnosed / "campaign", diagnosed / "out", report=False)
    again = json.loads((diagnosed / "out" / "gap.json").read_text())
    for volatile in ("seconds", "next_experiment"):
        del first[volatile], again[volatile]
    # Equal but for rounding: sums of many numbers depend on the number of threads.
    found, expected = flat(again), flat(first)
    assert found.keys() == expected.keys()
    for place, value in expected.items():
        near = pytest.approx(value, rel=1e-6, abs=1e-12) if isinstance(value, float) else value
        assert found[place] == near, place
    with pytest.raises(ValueError, match="without"):
        diagnose_campaign(diagnosed / "campaign", diagnosed / "out", without=["flow_force"])


def test_without_its_effect_the_gap_is_unknown(diagnosed, tmp_path):
    without = all_but("local_gas_speed", *MANY)
    found = diagnose_campaign(diagnosed / "campaign", tmp_path, without=without, report=False)
    assert found.conclusion.verdict in ("unknown", "no_gap")
    assert not found.conclusion.ambiguity_set


def test_an_unknown_cause_is_refused(diagnosed, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    options = ["--out", "out", "--without", "gremlins"]
    assert main(["gap", str(diagnosed / "campaign"), *options]) == 2
    assert "no cause is named gremlins" in capsys.readouterr().err
    assert not (tmp_path / "out" / "gap.json").exists()


def test_nothing_held_out_is_refused(tmp_path):
    fitted = damaged(lambda recording: replace(recording, role="calibration"))
    write_campaign(fitted, tmp_path / "campaign")
    with pytest.raises(ValueError, match="held out"):
        diagnose_campaign(tmp_path / "campaign", tmp_path / "out", report=False)
    assert not (tmp_path / "out" / "gap.json").exists()


def noise_only(recording: Recording) -> Recording:
    """The p2 sensor is loose: it shows its noise about one value."""
    rng = np.random.default_rng(len(recording))
    return replace(recording, p2=7e5 + 300.0 * rng.standard_normal(len(recording)))


def in_milliamperes_of_another_range(recording: Recording) -> Recording:
    """A current that was read off the wrong scale."""
    return replace(recording, I=2.0 * recording.I)


@pytest.mark.parametrize(
    ("damage", "causes"),
    [
        (noise_only, ("eddy_current", *MANY)),
        (in_milliamperes_of_another_range, ("current_sensor_gain", "flyback_voltage", "coil_heating")),
    ],
)
def test_damaged_recordings_name_for_sure_only_what_looks_the_same(damage, causes, tmp_path):
    try:
        write_campaign(damaged(damage), tmp_path / "campaign")
        found = diagnose_campaign(
            tmp_path / "campaign", tmp_path / "out", without=all_but(*causes), report=False
        )
    except CampaignError:
        return  # refused, which is as good
    # A doubled current is just that; behind a piston that is held shut p2 stands still, too.
    same = {"current_sensor_gain", "piston_friction", "parameter:cPV"}
    named = {name for cause in found.conclusion.ambiguity_set for name in cause.effects}
    assert found.conclusion.verdict != "known" or named <= same
