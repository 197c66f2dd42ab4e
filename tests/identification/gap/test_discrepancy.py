"""Noise and discrepancy: both are recovered from residuals of known make."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from identification.gap.discrepancy import (
    ChannelDiscrepancy,
    channel_discrepancies,
    white_variance,
)
from identification.gap.plant import Channel, Run
from tests.identification.gap.drives import Drive

PERIOD, SAMPLES, RUNS = 1e-3, 4000, 3


@dataclass
class Recorded(Drive):
    """A plant of which only its channels and runs count."""

    runs: tuple[Run, ...] = ()
    channels: tuple[Channel, ...] = ()


def seen(residuals: list[NDArray], trusted: NDArray | None = None) -> list[ChannelDiscrepancy]:
    """residuals: per run (channels, samples) [noise deviations]; trusted: (channels, samples)."""
    counted = np.ones(residuals[0].shape, dtype=bool) if trusted is None else trusted
    numbers = range(len(counted))
    plant = Recorded(
        channels=tuple(Channel(name=str(c), unit="1", scale=1.0, noise=1.0) for c in numbers),
        runs=tuple(
            Run(
                name=str(r), held_out=False, time=PERIOD * np.arange(own.shape[1]), measured=own,
                trusted=counted, inputs={},
            )
            for r, own in enumerate(residuals)
        ),
    )  # fmt: skip
    return channel_discrepancies(plant, [np.where(counted, own, 0.0) for own in residuals])


def white(rng: np.random.Generator, samples: int = SAMPLES) -> NDArray:
    return rng.standard_normal((1, samples))


def coloured(rng: np.random.Generator, time_scale: float, samples: int = SAMPLES) -> NDArray:
    """Ornstein-Uhlenbeck process of variance 1, (1, samples); time_scale [s]."""
    memory = np.exp(-PERIOD / time_scale)
    drive = np.sqrt(1.0 - memory**2) * white(rng, samples)
    drive[0, 0] /= np.sqrt(1.0 - memory**2)
    return np.asarray(lfilter([1.0], [1.0, -memory], drive))


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("size", [0.3, 5.0])
def test_white_noise_has_no_discrepancy(seed, size):
    rng = np.random.default_rng(seed)
    (found,) = seen([size * white(rng) for _ in range(RUNS)])
    assert found.sd == 0.0
    assert found.time_scale == 0.0
    assert found.inflation == 1.0
    assert found.floor == pytest.approx(size**2, rel=0.06)
    assert found.readings == RUNS * SAMPLES


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(("sd", "time_scale"), [(1.0, 0.02), (0.7, 0.005), (2.0, 0.05)])
def test_a_coloured_part_is_recovered_beside_noise(seed, sd, time_scale):
    """To a fifth in size, and to two fifths in time scale, which 12 s of it show no better."""
    rng = np.random.default_rng(seed)
    (found,) = seen([white(rng) + sd * coloured(rng, time_scale) for _ in range(RUNS)])
    assert found.sd == pytest.approx(sd, rel=0.2)
    assert found.time_scale == pytest.approx(time_scale, rel=0.4)
    assert found.mean_square == pytest.approx(1.0 + sd**2, rel=0.2)


@pytest.mark.parametrize("seed", range(2))
def test_a_ripple_that_is_always_there_belongs_to_the_floor(seed):
    """No cause can remove it, and its readings do not tell as much as independent ones."""
    rng = np.random.default_rng(seed)
    (found,) = seen([white(rng) + 2.0 * coloured(rng, 0.01) for _ in range(RUNS)])
    assert found.floor == pytest.approx(5.0, rel=0.25)
    assert found.inflation > 5.0


@pytest.mark.parametrize("seed", range(2))
def test_what_differs_in_motion_only_does_not_belong_to_the_floor(seed):
    rng = np.random.default_rng(seed)
    moving = np.arange(SAMPLES) % 1000 < 200
    (found,) = seen([white(rng) + 4.0 * moving * coloured(rng, 0.01) for _ in range(RUNS)])
    assert found.floor == pytest.approx(1.0, rel=0.25)
    assert found.inflation == 1.0
    assert found.sd > 1.0


@pytest.mark.parametrize("misfit", [0.0, 1.0])
def test_recordings_without_noise_have_a_finite_floor(misfit):
    shape = misfit * np.sin(np.arange(SAMPLES) / 50.0)[None]
    (found,) = seen([shape] * RUNS)
    numbers = [found.floor, found.inflation, found.autocorrelation, found.sd, found.time_scale]
    assert np.all(np.isfinite(numbers))
    assert found.floor > 0.0
    assert found.floor <= max(found.mean_square, np.finfo(float).tiny)


def test_chance_in_few_readings_is_no_discrepancy():
    """Of 400 records of 300 readings of white noise at most one in a hundred seems coloured."""
    rng = np.random.default_rng(0)
    found = [seen([white(rng, 300)])[0] for _ in range(200)]
    assert np.mean([each.sd > 0.0 for each in found]) < 0.01
    assert np.mean([each.floor < 0.9 * each.mean_square for each in found]) < 0.01


@pytest.mark.parametrize("share", [0.2, 0.3, 0.9, 1.0])
def test_the_white_variance_of_an_exact_covariance(share):
    """A white part and a geometric one, whose sum is 1."""
    covariance = (1.0 - share) * 0.8 ** np.arange(10.0)
    covariance[0] += share
    assert white_variance(covariance) == pytest.approx(share, abs=1e-9)


@pytest.mark.parametrize("seed", range(1))
def test_a_faint_but_long_correlation_lowers_what_readings_tell(seed):
    rng = np.random.default_rng(seed)
    share, correlated, samples = 0.05, 100.0, 40_000
    (found,) = seen(
        [
            white(rng, samples) + np.sqrt(share) * coloured(rng, correlated * PERIOD, samples)
            for _ in range(RUNS)
        ]
    )
    independent = 1.0 + share / (1.0 + share) * 2.0 * correlated
    assert 0.4 * independent < found.autocorrelation < 1.2 * independent
