"""White noise, ripples and misfits: each is told from the others in residuals of known make."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from identification.gap.plant import Channel
from identification.gap.prepare.noise import RAW_TOLERANCE, ChannelNoise, residual_noise
from identification.noise import LEAST, Ripple, autocovariance, white_noise

PERIOD, SAMPLES, RUNS = 1e-3, 4000, 3


def seen(residuals: list[NDArray], readings: list[NDArray] | None = None) -> ChannelNoise:
    """residuals, readings: per run (samples,) [noise deviations]; the model is at rest without these."""
    plant: Any = SimpleNamespace(runs=[], channels=[Channel(name="y", unit="1", scale=1.0, noise=1.0)])
    for own in readings or residuals:
        time, trusted = PERIOD * np.arange(len(own)), np.ones((1, len(own)), bool)
        plant.runs.append(SimpleNamespace(time=time, measured=own[None], trusted=trusted))
    return residual_noise(plant, [own[None] for own in residuals])[0]


def coloured(rng: np.random.Generator, decay: float, samples: int = SAMPLES) -> NDArray:
    """First-order process of variance 1, (samples,)."""
    drive = np.sqrt(1.0 - decay**2) * rng.standard_normal(samples)
    drive[0] /= np.sqrt(1.0 - decay**2)
    return np.asarray(lfilter([1.0], [1.0, -decay], drive))


def rippled(seed: int, sd: float, decay: float, samples: int = SAMPLES) -> list[NDArray]:
    """White noise of variance 1 with a ripple, per run (samples,)."""
    rng = np.random.default_rng(seed)
    return [rng.standard_normal(samples) + sd * coloured(rng, decay, samples) for _ in range(RUNS)]


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("size", [0.3, 5.0])
def test_white_noise_is_found_and_nothing_beside_it(seed, size):
    readings = [size * own for own in rippled(seed, 0.0, 0.0)]
    course = 100.0 * size * np.sin(np.arange(SAMPLES) / 100.0)
    assert white_noise([course + own for own in readings]) == pytest.approx(size, rel=0.02)
    found = seen(readings)
    assert found.floor == pytest.approx(size**2, rel=0.06)
    assert (found.sd, found.time_scale, found.correlated, found.ripple) == (0.0, 0.0, 1.0, None)
    assert found.readings == RUNS * SAMPLES


@pytest.mark.parametrize("variance", [0.5, 4.0])
@pytest.mark.parametrize(("white", "decay"), [(1.0, 0.95), (1.0, 0.7), (0.0, 0.9)])
def test_a_filtered_ripple_is_white(variance, white, decay):
    rng, samples = np.random.default_rng(1), 40_000
    series = np.sqrt(white) * rng.standard_normal(samples)
    series += np.sqrt(variance) * coloured(rng, decay, samples)
    ripple = Ripple.of(variance, white, decay)
    covariance = autocovariance([ripple.whitened(series[:, None])[:, 0]])
    assert covariance[0] == pytest.approx(1.0, rel=0.05)
    assert np.max(np.abs(covariance[1:11])) < 3.0 / np.sqrt(samples)
    assert ripple.sd == pytest.approx(np.sqrt(variance))
    assert np.exp(-1.0 / ripple.samples) == pytest.approx(decay)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("sd", "decay"), [(1.0, 0.95), (2.0, 0.9), (2.0, 0.8)])
def test_a_ripple_that_is_always_there_is_found_beside_the_floor(seed, sd, decay):
    found = seen(rippled(seed, sd, decay))
    assert found.ripple is not None
    assert found.ripple.sd == pytest.approx(sd, rel=0.15)
    assert found.ripple.decay == pytest.approx(decay, rel=0.15)
    assert found.floor == pytest.approx(1.0, rel=0.25)
    assert found.correlated > 3.0
    assert found.sd == pytest.approx(sd, rel=0.15)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("misfit", [1.0, 4.0])
def test_what_differs_in_one_of_four_seconds_only_leaves_the_floor(seed, misfit):
    rng, moving = np.random.default_rng(seed), np.arange(SAMPLES) // 1000 == 2
    found = seen([own + misfit * moving * coloured(rng, 0.95) for own in rippled(seed + 9, 0.0, 0.0)])
    assert found.sd > 0.2 * misfit
    assert found.floor == pytest.approx(1.0, rel=0.25)


@pytest.mark.parametrize("misfit", [1.0, 4.0, 20.0])
@pytest.mark.parametrize("decay", [0.0, 0.5, 0.95])
def test_the_floor_is_at_most_what_raw_readings_allow(misfit, decay):
    """Whatever remains: readings whose noise is that of the channel are no worse than it says."""
    readings, rng = rippled(0, 0.0, 0.0), np.random.default_rng(1)
    found = seen([own + misfit * coloured(rng, decay) for own in readings], readings)
    assert found.floor <= (RAW_TOLERANCE * max(white_noise(readings), 1.0)) ** 2


@pytest.mark.parametrize("misfit", [0.0, 1.0])
def test_recordings_without_noise_have_a_finite_floor(misfit):
    shape = misfit * np.sin(np.arange(SAMPLES) / 50.0)
    found = seen(RUNS * [shape])
    assert np.all(np.isfinite([found.floor, found.correlated, found.sd, found.time_scale]))
    assert 0.0 < found.floor <= max(np.mean(shape**2), LEAST)


def test_chance_in_few_readings_is_neither_ripple_nor_discrepancy():
    """Of 200 records of 300 readings of white noise at most one in a hundred seems coloured."""
    rng = np.random.default_rng(0)
    found = [seen([rng.standard_normal(300)]) for _ in range(200)]
    assert np.mean([each.sd > 0.0 or bool(each.ripple) for each in found]) < 0.01
