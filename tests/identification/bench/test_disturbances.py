"""Ripple and steps on recordings are what they are said to be, and touch nothing else."""

import numpy as np
import pytest

from epv_env.plant.channels import SENSORS
from identification.bench.session import add_ripple, round_pressures
from identification.recordings.recording import UNITS, CampaignError
from tests.identification.twins import twin

SD = {"p2": 2 * SENSORS["p2"].noise, "p3": 2 * SENSORS["p3"].noise}


def ripples(channel, seed=3):
    """What `add_ripple` adds to the channel, per recording, (samples,) [A, V, bar]."""
    rippled = add_ripple(twin(), sd=SD, correlation_time=0.02, seed=seed)
    return [
        (after.channel(channel) - before.channel(channel)) / UNITS[channel][1]
        for before, after in zip(twin().recordings, rippled.recordings, strict=True)
    ]


@pytest.mark.parametrize("channel", SD)
def test_ripple_has_its_deviation_and_its_correlation_time(channel):
    ripple = max(ripples(channel), key=len)
    lag = round(0.02 / twin().recordings[0].period)
    assert np.std(ripple) == pytest.approx(SD[channel], rel=0.15)
    correlation = np.mean(ripple[lag:] * ripple[:-lag]) / np.mean(ripple**2)
    assert correlation == pytest.approx(np.exp(-1), abs=0.15)


def test_ripple_is_whole_steps_and_differs_between_recordings_channels_and_seeds():
    first, second = ripples("p2")[:2]
    steps = first / SENSORS["p2"].resolution
    assert np.allclose(steps, np.rint(steps), atol=1e-6)
    count = min(len(first), len(second))
    for other in (second, ripples("p3")[0], ripples("p2", seed=4)[0]):
        assert abs(np.corrcoef(first[:count], other[:count])[0, 1]) < 0.5


def test_rounded_pressures_are_the_nearest_multiples():
    rounded = round_pressures(twin(), 0.05)
    for before, after in zip(twin().recordings, rounded.recordings, strict=True):
        for channel in ("p1", "p2", "p3"):
            steps = after.channel(channel) / 5e3
            assert np.allclose(steps, np.rint(steps), atol=1e-9)
            assert np.max(np.abs(after.channel(channel) - before.channel(channel))) <= 2500.001
        assert np.array_equal(before.I, after.I)
        assert np.array_equal(before.U, after.U)


@pytest.mark.parametrize(
    ("disturb", "message"),
    [
        (lambda: add_ripple(twin(), sd={"p4": 0.01}, correlation_time=0.02, seed=0), "p4"),
        (lambda: add_ripple(twin(), sd={"p2": -1.0}, correlation_time=0.02, seed=0), "0 or more"),
        (lambda: add_ripple(twin(), sd=SD, correlation_time=0.0, seed=0), "positive time"),
        (lambda: round_pressures(twin(), 0.0), "positive step"),
    ],
)
def test_senseless_disturbances_are_refused(disturb, message):
    with pytest.raises(CampaignError, match=message):
        disturb()
