"""The step of readings is found as they show it, and a coarse one makes a steady pressure credible."""

import re
from dataclasses import replace

import numpy as np
import pytest

from identification.noise import quantisation_step
from identification.recordings.campaign_files import read_campaign, write_campaign
from identification.recordings.noise import campaign_steps, coarse_step_warnings
from identification.recordings.recording import PRESSURES, CampaignError
from tests.identification.disturbances import round_pressures
from tests.identification.recordings.good_campaign import good_campaign

STEP = 0.05
"""Of a vehicle's bus [bar]."""


def coarse(change=None, which=0):
    """The good campaign in coarse steps, with other signals in one recording [SI]."""
    campaign = round_pressures(good_campaign(), STEP)
    recordings = list(campaign.recordings)
    if change:
        recordings[which] = replace(recordings[which], **change(recordings[which]))
    return replace(campaign, recordings=tuple(recordings))


def held(name, value):
    """Puts one value [SI] into a whole channel."""
    return lambda recording: {name: np.full(len(recording), value)}


@pytest.mark.parametrize(("digits", "error"), [(None, 1e-12), (5, 1e-5)])
def test_the_step_is_found_though_codes_are_missing_and_digits_are_few(digits, error):
    """To a printed digit."""
    step = 15 / 4096
    codes = np.array([0, 1, 2, 5, 6, 40] * 100)
    readings = 1.0 + step * codes
    readings = readings if digits is None else np.round(readings, digits)
    assert quantisation_step([readings]) == pytest.approx(step, abs=error)


def test_continuous_readings_have_no_step():
    assert quantisation_step([np.random.default_rng(0).standard_normal(1000)]) == 0.0
    assert quantisation_step([np.ones(1000)], fewest=1) == 0.0


def test_the_steps_of_a_bus_are_found_and_said():
    steps = campaign_steps(coarse(held("p1", 12e5)).recordings)
    assert steps == pytest.approx(dict.fromkeys(PRESSURES, 5e3))
    (sentence,) = coarse_step_warnings(steps)
    assert "p1 50 mbar" in sentence
    assert "dead sensor" in sentence
    assert campaign_steps(good_campaign().recordings) == {}
    assert coarse_step_warnings({}) == []


def still(recording):
    return {name: np.full(len(recording), 1e5) for name in PRESSURES}


@pytest.mark.parametrize(("change", "which"), [(None, 0), (held("p1", 12e5), 0), (still, 2)])
def test_a_campaign_in_coarse_steps_is_accepted(tmp_path, change, which):
    """Its supply may read the same throughout, and at rest every pressure."""
    write_campaign(coarse(change, which), tmp_path)
    assert len(read_campaign(tmp_path).recordings) == 3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (held("p2", 7e5), "p2_bar is 7 throughout.*: check its sensor"),
        (held("I", 0.5), "I_A is 0.5 throughout.*: check its sensor"),
        (
            held("p1", 15e5),
            "p1 is 15 and p3 12 bar, although .*: check unit, reference, sign and sensor of p1_bar",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_coarse_steps_too(tmp_path, change, message):
    with pytest.raises(CampaignError) as caught:
        write_campaign(coarse(change), tmp_path)
    assert re.search(message, str(caught.value))
    assert not any(tmp_path.iterdir())


def test_readings_of_another_grid_do_not_borrow_the_step():
    """p1 between the others' steps is no reading of theirs."""
    campaign = coarse(lambda r: {"p1": 12e5 + 2e3 * (np.arange(len(r)) % 2)})
    assert "p1" not in campaign_steps(campaign.recordings[:2])
