"""The time scale of a plant: from its readings, through noise, or as the plant gives it."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.gap.plant import Channel, Run
from identification.gap.prepare.prepared_plant import time_scale
from identification.valve_gap.valve import TIME_SCALE


def recorded(*series: np.ndarray, period: float, noise: float, trusted: np.ndarray | None = None) -> Any:
    """A plant with one channel of these readings, one run each."""
    runs = tuple(
        Run(
            name=f"run{i}",
            held_out=i == 0,
            time=np.arange(len(y)) * period,
            measured=y[None],
            trusted=np.ones((1, len(y)), dtype=bool) if trusted is None else trusted,
            inputs={},
        )
        for i, y in enumerate(series)
    )
    channel = Channel(name="y", unit="1", scale=1.0, noise=noise)
    return SimpleNamespace(runs=runs, channels=(channel,))


@dataclass
class Course:
    """A noise-free course, its sampling period and its time scale."""

    values: np.ndarray
    period: float
    scale: float


def sine(length: float, period: float, sampling: float) -> Course:
    time = np.arange(0.0, length, sampling)
    fifth = np.arccos(1 / np.e) / (2 * np.pi)
    return Course(np.sin(2 * np.pi * time / period), sampling, fifth * period)


def relaxation(length: float, constant: float, sampling: float) -> Course:
    """Responses of a first-order lag to eight steps of its input."""
    count = round(length / sampling)
    steps = np.random.default_rng(5).standard_normal(8)
    inputs = np.repeat(steps, count // 8 + 1)[:count]
    keep = np.exp(-sampling / constant)
    return Course(np.asarray(lfilter([1 - keep], [1, -keep], inputs)), sampling, constant)


COURSES = {
    "pendulum at 100 Hz": sine(30.0, 1.0, 0.01),
    "slow sine": sine(100.0, 10.0, 0.01),
    "lag": relaxation(40.0, 1.0, 0.01),
    "car, 80 samples at 10 Hz": relaxation(8.0, 0.3, 0.1),
    "thermal lab at 1 Hz": relaxation(2400.0, 60.0, 1.0),
}


@pytest.mark.parametrize("name", COURSES)
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_it_is_the_time_constant_or_a_fifth_of_the_period(name, noise):
    course = COURSES[name]
    readings = course.values + noise * np.random.default_rng(1).standard_normal(len(course.values))
    found = time_scale(recorded(readings, period=course.period, noise=max(noise, 1e-4)))
    assert course.scale / 3 < found < 3 * course.scale


def test_a_channel_read_at_every_tenth_sample_has_the_same_time_scale():
    course = COURSES["lag"]
    trusted = np.zeros((1, len(course.values)), dtype=bool)
    trusted[0, ::10] = True
    readings = np.where(trusted[0], course.values, np.nan)
    found = time_scale(recorded(readings, period=course.period, noise=1e-4, trusted=trusted))
    assert found == pytest.approx(course.scale, rel=0.3)


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_plant_that_does_not_move_has_a_share_of_its_run(noise):
    still = noise * np.random.default_rng(2).standard_normal(1000)
    assert time_scale(recorded(still, period=0.1, noise=1.0)) == pytest.approx(0.999)


def test_a_plant_s_own_time_scale_counts():
    plant = recorded(COURSES["lag"].values, period=0.01, noise=1e-3)
    plant.time_scale = 0.25
    assert time_scale(plant) == 0.25
    assert TIME_SCALE == 5e-3
    plant.time_scale = 0.0
    with pytest.raises(ValueError, match="positive time in s"):
        time_scale(plant)
