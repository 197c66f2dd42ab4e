"""Disturbances: what the diagnosis is told, and what they do to the recordings."""

from functools import cache

import numpy as np
import pytest

from epv_env.plant.channels import SENSORS
from identification.recordings.recording import OUTPUTS, UNITS
from identification.studies.blind.bench import blind_campaign, blind_suite, run_programme
from identification.studies.blind.disturbances import (
    DISTURBANCES,
    RIPPLE,
    STEPS,
    disturbed,
    disturbs_recordings,
    told_noise,
)
from identification.studies.blind.kinds import NOMINAL
from identification.studies.blind.noise_free_gap import noise_deviation
from identification.studies.blind.truth import draw_trial


@cache
def campaign():
    """One recording of a valve without an effect."""
    trial = draw_trial(7, 0, NOMINAL, [])
    programme = next(p for p in blind_suite() if p.name == "validation")
    rng = np.random.default_rng(0)
    truth = run_programme(trial.parameters, programme, form_deviation=0.0, rng=rng)
    return blind_campaign([truth], trial, 7)


def apart(disturbance, channel, seed=1):
    one, other = campaign(), disturbed(campaign(), disturbance, seed=seed)
    return (other.recordings[0].channel(channel) - one.recordings[0].channel(channel)) / UNITS[channel][
        1
    ]


@pytest.mark.parametrize(("disturbance", "factor"), [("sigma=0.3", 0.3), ("sigma=3", 3.0)])
def test_the_true_noise_is_told_too_small_or_too_large(disturbance, factor):
    assert told_noise(disturbance) == pytest.approx({n: factor * noise_deviation(n) for n in OUTPUTS})
    assert not disturbs_recordings(disturbance)
    assert disturbed(campaign(), disturbance, seed=1) is campaign()


@pytest.mark.parametrize("disturbance", [RIPPLE, STEPS])
def test_disturbed_recordings_come_without_a_word_on_their_noise(disturbance):
    assert told_noise(disturbance) is None
    assert disturbs_recordings(disturbance)


@pytest.mark.parametrize("channel", ["p2", "p3"])
def test_a_ripple_is_twice_the_noise_and_lasts_twenty_milliseconds(channel):
    ripple = apart(RIPPLE, channel)
    samples = round(0.02 / campaign().recordings[0].period)
    assert np.std(ripple) / SENSORS[channel].noise == pytest.approx(2.0, rel=0.35)
    correlation = np.corrcoef(ripple[:-samples], ripple[samples:])[0, 1]
    assert correlation == pytest.approx(np.exp(-1), abs=0.25)


def test_a_ripple_leaves_the_other_channels_and_is_drawn_by_its_seed():
    for channel in ("I", "U", "p1"):
        assert not np.any(apart(RIPPLE, channel))
    assert np.array_equal(apart(RIPPLE, "p2"), apart(RIPPLE, "p2"))
    assert not np.array_equal(apart(RIPPLE, "p2"), apart(RIPPLE, "p2", seed=2))


@pytest.mark.parametrize("channel", ["p1", "p2", "p3"])
def test_coarse_pressures_are_multiples_of_fifty_millibar(channel):
    readings = disturbed(campaign(), STEPS, seed=1).recordings[0].channel(channel) / UNITS[channel][1]
    np.testing.assert_allclose(readings / 0.05, np.rint(readings / 0.05), atol=1e-6)
    assert np.max(np.abs(apart(STEPS, channel))) <= 0.025 + 1e-9


def test_every_disturbance_says_what_it_does():
    assert set(DISTURBANCES) == {"sigma=0.3", "sigma=3", "ripple", "steps"}
