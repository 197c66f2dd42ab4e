"""The noise of readings about a course that moves."""

import numpy as np
import pytest

from identification.recordings.recording import Recording
from identification.valve_gap.noise import noise_of


def recording(noise: float, seed: int, steps: float = 0.0) -> Recording:
    """p2 that rises, with steps at the switchings; nothing else of interest."""
    rng = np.random.default_rng(seed)
    time = np.arange(4000) * 5e-4
    U = np.where((time % 0.4) < 0.3, 24.0, 0.0)
    course = 6e5 + 2e5 * time + steps * np.cumsum(np.abs(np.diff(U, prepend=24.0)) > 1)
    p2 = course + noise * rng.standard_normal(len(time))
    return Recording(
        name="x", role="calibration", period=5e-4, I=0 * time, U=U, p1=p2, p2=p2, p3=p2,
        sigma_S=0 * time,
    )  # fmt: skip


@pytest.mark.parametrize("steps", [0.0, 1e4])
def test_noise_is_found_whatever_the_course(steps):
    found = [noise_of([recording(300.0, seed, steps)], "p2") for seed in range(20)]
    assert np.mean(found) == pytest.approx(300.0, rel=0.01)
    assert np.std(found) < 0.03 * 300.0


def test_more_noise_is_more():
    assert noise_of([recording(600.0, 0)], "p2") > 1.8 * noise_of([recording(300.0, 0)], "p2")
