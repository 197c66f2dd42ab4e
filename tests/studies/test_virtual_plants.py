"""Trials of the small virtual plants: truth and model agree, and every cause acts."""

from collections.abc import Mapping

import numpy as np
import pytest
from numpy.typing import NDArray

from docs.studies.calibration.virtual_plants import command, draw_trial, true_readings, with_recordings
from docs.studies.calibration.virtual_systems import SYSTEMS

plants = pytest.mark.parametrize("plant", SYSTEMS)


def commands(plant: str) -> list[NDArray]:
    """Of four recordings."""
    rng = np.random.default_rng(1)
    return [command(SYSTEMS[plant], rng, run) for run in range(4)]


def truth(plant: str, values: Mapping[str, float], deviation: float = 0.0) -> NDArray:
    """Exact readings of all runs, (channels, samples) [noise deviations]."""
    noise = np.array([channel.known_noise for channel in SYSTEMS[plant].channels])[:, None]
    return np.concatenate(true_readings(plant, values, deviation, commands(plant)), axis=1) / noise


def model(plant: str, values: Mapping[str, float]) -> NDArray:
    """The same of the model."""
    system, given = SYSTEMS[plant], commands(plant)
    own = with_recordings(plant, given, true_readings(plant, {}, 0.0, given), system.channels)
    noise = np.array([channel.known_noise for channel in system.channels])[:, None]
    candidate = {symbol: np.array([value]) for symbol, value in values.items()}
    return np.concatenate(own.outputs(candidate, range(4)), axis=1)[..., 0] / noise


def rms(difference: NDArray) -> float:
    """Of all readings."""
    return float(np.sqrt(np.mean(difference**2)))


@plants
def test_truth_and_model_agree_without_a_cause(plant: str):
    """To a tenth of the noise at every sample, with parameters off their nominal values."""
    unit = {p.symbol: 1.05 * p.nominal for p in SYSTEMS[plant].parameters}
    assert np.max(np.abs(truth(plant, unit) - model(plant, unit))) < 0.1


@plants
def test_the_model_with_the_cause_reproduces_the_truth(plant: str):
    """Without a deviation, to a tenth of the noise; with one, not."""
    for cause in SYSTEMS[plant].causes:
        size = {cause.name: cause.parameters[0].trials[-1]}
        assert rms(truth(plant, size) - model(plant, size)) < 0.1, cause.name
        assert rms(truth(plant, size, 0.5) - model(plant, size)) > 0.1, cause.name


@plants
def test_every_mechanism_can_be_seen(plant: str):
    """The largest size shows clearly, and no stranger acts in the model."""
    system = SYSTEMS[plant]
    largest = {c.name: c.parameters[0].high for c in system.causes} | dict(system.strangers)
    nominal = truth(plant, {})
    for name, size in largest.items():
        assert rms(truth(plant, {name: size}) - nominal) > 5.0, name
    assert not {*system.strangers} & {c.name for c in system.causes}


@plants
def test_a_trial_is_drawn_from_its_seed(plant: str):
    """The same arguments give the same readings; another number gives others."""
    first, again, other = (draw_trial(plant, 3, number, "strong") for number in (2, 2, 4))
    assert (first.kind, first.causes, first.deviation) == (again.kind, again.causes, again.deviation)
    for run, same, different in zip(first.plant.runs, again.plant.runs, other.plant.runs, strict=True):
        assert np.array_equal(run.measured, same.measured)
        assert not np.array_equal(run.measured, different.measured)
