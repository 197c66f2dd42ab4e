"""The noise floor: found in the residuals, whatever noise the plant states, under slow ripple too."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.gap.fit.gaps import GapDraws
from identification.gap.prepare.noise import RAW_TOLERANCE
from identification.readings_noise import white_noise

SAMPLES = 2500
"""Of each of two recordings, as many as the valve's held-out ones have at 0.5 ms."""


def white(seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [rng.standard_normal((1, SAMPLES)) for _ in range(2)]


def correlated(memory: float, seed: int) -> list[np.ndarray]:
    """Ornstein-Uhlenbeck noise of unit variance with a memory in samples."""
    keep = np.exp(-1.0 / memory)
    drive = [np.sqrt(1 - keep**2) * y for y in white(seed)]
    return [np.asarray(lfilter([1.0], [1.0, -keep], y)) for y in drive]


def judged(residuals: list[np.ndarray], trusted: list[np.ndarray] | None = None) -> GapDraws:
    """Gaps of a model with these residuals [stated noise deviations] on held-out runs.

    The model is at rest: the readings are its residuals.
    """
    masks = trusted or [np.ones(y.shape, dtype=bool) for y in residuals]
    runs = tuple(
        SimpleNamespace(held_out=True, time=np.arange(SAMPLES) * 5e-4, trusted=mask, measured=y)
        for y, mask in zip(residuals, masks, strict=True)
    )
    plant: Any = SimpleNamespace(runs=runs, channels=(SimpleNamespace(name="y", known_noise=1.0),))
    counted = [y * mask for y, mask in zip(residuals, masks, strict=True)]
    return GapDraws(plant, {"model": counted}, 1, scale=5e-3)


@pytest.mark.parametrize("factor", [0.3, 3.0])
def test_white_noise_alone_is_the_floor_whatever_noise_is_stated(factor):
    for seed in range(3):
        found = judged([y / factor for y in white(seed)])
        assert found.overall("model")[0] == pytest.approx(1.0, abs=0.05)
        assert found.noise[0] == pytest.approx(1 / factor, rel=0.05)


@pytest.mark.parametrize("factor", [0.3, 3.0])
def test_under_a_slow_ripple_the_white_part_is_the_floor(factor):
    """20 ms at twice the sensors' noise, as the supply's pulsation gives."""
    for seed in range(3):
        ripple = correlated(40.0, 100 + seed)
        readings = [(y + 2 * r) / factor for y, r in zip(white(seed), ripple, strict=True)]
        found = judged(readings)
        assert found.noise[0] == pytest.approx(1 / factor, rel=0.07)
        assert found.overall("model")[0] > 1.8


@pytest.mark.parametrize("memory", [0.8, 2.0, 10.0])
def test_where_the_noise_itself_is_coloured_the_floor_is_what_neighbours_differ_by(memory):
    """At most as raw readings allow, at least half of the variance by first differences."""
    readings = [1.5 * y for y in correlated(memory, 7)]
    raw = white_noise([y[0] for y in readings])
    neighbours = np.std(np.concatenate([np.diff(y[0]) for y in readings])) / np.sqrt(2)
    found = judged(readings)
    assert 0.7 * neighbours < found.noise[0] < RAW_TOLERANCE * max(raw, 1.0)


@pytest.mark.parametrize("every", [2, 5])
def test_a_channel_read_more_seldom_has_a_floor_too(every):
    mask = np.zeros((1, SAMPLES), dtype=bool)
    mask[0, ::every] = True
    found = judged([y / 3 for y in white(4)], [mask, mask])
    assert found.noise[0] == pytest.approx(1 / 3, rel=0.1)
    assert found.overall("model")[0] == pytest.approx(1.0, abs=0.1)
