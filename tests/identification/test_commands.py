"""The command line as a user meets it: files written, refusals, the same again, on to the env."""

import argparse
import importlib
import json
import re
from contextlib import redirect_stdout
from io import StringIO
from typing import Any

import gymnasium
import numpy as np
import pytest

import epv_env  # noqa: F401 - registers the environments
from epv_env.common.commands import commands, help_line
from epv_env.common.options import parser_of
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import load_plant
from identification.__main__ import main
from identification.calibration import search as starts
from identification.recordings.campaign_files import read_campaign


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """The report's recordings from a virtual bench, with another resistance than Table 12's."""
    folder = tmp_path_factory.mktemp("bench") / "campaign"
    truth = folder.parent / "truth.json"
    arguments = ["--out", str(folder), "--seed", "3", "--set", "R=43", "--truth", str(truth)]
    assert main(["bench", *arguments]) == 0
    return folder


@pytest.fixture(scope="module")
def finished(campaign, tmp_path_factory):
    """A folder in which `run` has worked on it."""
    out = tmp_path_factory.mktemp("run")
    with redirect_stdout(StringIO()) as said:
        assert main(["run", str(campaign), "--out", str(out), "--starts", "2"]) == 0
    (resistance,) = [line for line in said.getvalue().splitlines() if "(R) | " in line]
    assert re.search(r" \| 4[\d.]+ \(4[\d.]+ to 4[\d.]+\) ohm \| yes$", resistance, re.IGNORECASE)
    return out


def test_the_bench_writes_a_campaign_and_keeps_its_truth_elsewhere(campaign):
    recordings = read_campaign(campaign).recordings
    roles = [recording.role for recording in recordings]
    assert roles == ["calibration"] * 4 + ["validation", "quality"]
    assert load_plant(campaign.parent / "truth.json").parameters == Parameters.calibrated().replace(R=43)
    assert "43" not in (campaign / "campaign.json").read_text()


def test_an_effect_of_the_bench_goes_into_its_truth(tmp_path):
    truth = tmp_path / "truth.json"
    arguments = ["--out", str(tmp_path / "campaign"), "--truth", str(truth)]
    assert main(["bench", *arguments, "--effect", "circuit_leak=2e-7"]) == 0
    assert load_plant(truth).parameters["A_circuit"] == 2e-7
    test4 = next(r for r in read_campaign(tmp_path / "campaign").recordings if r.name == "test4")
    assert np.mean(test4.p2[600:700]) - np.mean(test4.p2[-100:]) > 5e3  # shut all the while


def test_run_finds_the_truth_and_says_so(finished):
    plant = load_plant(finished / "plant.json")
    assert plant.parameters["R"] == pytest.approx(43, rel=1e-3)
    content = json.loads((finished / "report.json").read_text())
    assert content["validation"]["errors_percent"]["validation"]["eps_partial"] < 1
    assert set(content) >= {"quality", "sensitivity", "calibration", "confidence", "validation"}
    assert len(plant.provenance["recordings_sha256"]["test1"]) == 64


def test_the_report_needs_no_other_file(finished):
    page = (finished / "report.html").read_text()
    sources = re.findall(r'(?:src|href)="([^"]{0,20})', page)
    assert len(sources) > 3
    assert all(source.startswith(("data:image/svg+xml", "#")) for source in sources)
    places = set(re.findall(r'href="#([^"]+)"', page))
    assert places <= set(re.findall(r'id="([^"]+)"', page))
    assert len(page) < 5e6


def test_the_report_begins_with_the_values_their_meaning_and_whether_to_trust_them(finished):
    page = (finished / "report.html").read_text()
    first = page[page.index("<h1>") : page.index("<details>")]
    value = f"{load_plant(finished / 'plant.json').parameters['R']:.5g}"
    assert f'resistance of the solenoid (R)</td><td data-column="value (95 % interval)">{value}' in first
    assert first.count('<tr class="good">') == 4
    assert first.count(">yes</td>") == 4
    assert "test1, test2, test3, test4 (calibration); validation (validation); rest (quality)" in first


def test_the_report_of_a_bench_says_nothing_of_2003(finished):
    printed = r"SCL-001|2003|[Tt]he report|Tables? \d|Figures? \d|[Ee]qs?\. ?\d|section \d"
    page = re.sub(
        r'<style>.*?</style>|src="[^"]*"', "", (finished / "report.html").read_text(), flags=re.S
    )
    assert re.findall(printed, page) == []


def test_the_environment_draws_its_plants_from_the_joint_region(finished):
    region = load_plant(finished / "plant.json").region
    made = gymnasium.make("EPValve-v0", plant=finished / "plant.json", parameters="confidence")
    env: Any = made.unwrapped
    drawn = []
    for seed in range(40):
        env.reset(seed=seed)
        drawn.append([env.task.parameters[0][symbol] for symbol in region.symbols])
    apart = np.array(drawn) - [region.centre[symbol] for symbol in region.symbols]
    assert region.covariance is not None
    scale = np.sqrt(np.diag(region.covariance))
    correlation = region.covariance / np.outer(scale, scale)
    scaled = apart / scale
    distances = np.einsum("ni,ij,nj->n", scaled, np.linalg.inv(correlation), scaled)
    assert len(np.unique(distances)) == 40
    assert np.max(distances) <= region.chi_square * (1 + 1e-9)
    assert np.max(distances) > 0.5 * region.chi_square


def test_a_second_run_gives_the_same_plant_and_searches_nothing(
    finished, campaign, monkeypatch, tmp_path, capsys
):
    before = (finished / "plant.json").read_bytes()

    def search(*_):
        raise AssertionError("a finished search was done again")

    monkeypatch.setattr(starts, "nelder_mead", search)
    monkeypatch.setattr(starts, "weighted_least_squares", search)
    arguments = [str(campaign), "--out", str(finished), "--starts", "2"]
    assert main(["run", "--stage", "confidence", *arguments]) == 0
    assert (finished / "plant.json").read_bytes() == before
    # Another seed has other starts: what is finished is neither used nor lost.
    assert main(["run", "--stage", "calibrate", *arguments, "--seed", "1"]) == 2
    assert "holds results with seed 0, not 1" in capsys.readouterr().err
    elsewhere = ["run", str(campaign), "--out", str(tmp_path / "other"), "--stage", "calibrate"]
    with pytest.raises(AssertionError, match="done again"):
        main([*elsewhere, "--seed", "1"])


def test_a_campaign_that_lacks_recordings_is_still_identified(campaign, tmp_path, capsys):
    folder = tmp_path / "four"
    folder.mkdir()
    content = json.loads((campaign / "campaign.json").read_text())
    content["recordings"] = [r for r in content["recordings"] if r["role"] == "calibration"]
    (folder / "campaign.json").write_text(json.dumps(content))
    for recording in content["recordings"]:
        (folder / recording["file"]).write_bytes((campaign / recording["file"]).read_bytes())
    stage = ["run", str(folder), "--out", str(tmp_path / "out"), "--starts", "1", "--stage"]
    for name, role in (("quality", "quality"), ("validate", "validation")):
        assert main([*stage, name]) == 2
        assert f"no recording with role '{role}'" in capsys.readouterr().err
    assert main([*stage, "calibrate"]) == 0
    page = (tmp_path / "out" / "calibrate.html").read_text()
    assert "No record at rest shows the sensors" in page


def test_a_bench_does_not_write_over_a_campaign(campaign, capsys):
    before = (campaign / "test1.csv").read_bytes()
    assert main(["bench", "--out", str(campaign), "--seed", "4"]) == 2
    assert "exists already" in capsys.readouterr().err
    assert (campaign / "test1.csv").read_bytes() == before


@pytest.mark.parametrize("module", commands(["identification.commands"]).values())
def test_every_option_says_what_it_sets(module):
    parser: argparse.ArgumentParser = parser_of(importlib.import_module(module), "epv")
    assert help_line(module).endswith(".")
    assert help_line(module) in parser.format_help()
    for action in parser._actions:
        assert action.help, action.dest
