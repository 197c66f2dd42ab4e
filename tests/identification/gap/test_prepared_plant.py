"""What an owner may leave out is added: noise, time from 0, readings that are no number."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from docs.examples.tank import Tank, virtual_recordings
from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.plant import Channel, FreeParameter, PlantError, Run, noise_weighted
from identification.gap.prepare.prepared_plant import PreparedPlant, prepared
from tests.identification.gap.tanks import without_gap

SIGMA = 0.02


def tank(*, noise: float | None = None, resolution: float = 0.0, **changes: object) -> Tank:
    """A tank whose channel and whose runs are described in another way."""
    found = Tank([replace(run, **changes) for run in virtual_recordings({"c": 0.021})])
    found.channels = (replace(found.channels[0], noise=noise, resolution=resolution),)
    return found


def recorded(*readings: NDArray, trusted: NDArray | None = None) -> PreparedPlant:
    """A prepared plant without a model: one channel of unknown noise, one run for each (samples,)."""
    runs = [
        Run(
            name=f"run {r}",
            held_out=False,
            time=0.1 * np.arange(len(own)),
            measured=own[None],
            trusted=np.ones((1, len(own)), bool) if trusted is None else trusted[None],
            inputs={},
        )
        for r, own in enumerate(readings)
    ]
    none = {"parameters": (), "causes": (), "tolerances": (), "run_offsets": (), "equations": ()}
    channel = Channel(name="y", unit="", scale=1.0)
    return prepared(SimpleNamespace(channels=(channel,), runs=runs, **none))  # type: ignore[arg-type]


def noisy(samples: int, period: float, seed: int = 0) -> NDArray:
    """A sine wave with noise, (samples,); period: [samples]."""
    noise = np.random.default_rng(seed).standard_normal(samples)
    return np.sin(2 * np.pi * np.arange(samples) / period) + SIGMA * noise


def test_neighbours_of_a_slow_channel_are_its_trusted_readings():
    readings, trusted = np.full(10_000, np.nan), np.zeros(10_000, bool)
    trusted[::10] = True
    readings[::10] = noisy(1000, 300.0)
    plant = recorded(readings, trusted=trusted)
    assert plant.channels[0].noise == pytest.approx(SIGMA, rel=0.1)
    np.testing.assert_array_equal(plant.runs[0].measured[0, ::10], readings[::10])
    assert np.all(np.isfinite(plant.runs[0].measured))


def test_constant_readings_ask_for_the_noise():
    with pytest.raises(PlantError, match=r"channel y: its noise is None.*give `noise` or `resolution`"):
        recorded(np.ones(100))


@pytest.mark.parametrize(
    ("noise", "resolution", "expected"),
    [
        (3e-3, 0.0, 3e-3),
        (3e-3, 1e-3, 3e-3),
        (1e-4, 1e-2, 1e-2 / np.sqrt(12)),
        (None, 1e-1, 1e-1 / np.sqrt(12)),
    ],
)
def test_given_noise_is_kept_unless_readings_are_coarser(noise, resolution, expected):
    plant = prepared(tank(noise=noise, resolution=resolution))
    assert plant.channels[0].noise == pytest.approx(expected)


def test_runs_begin_at_0_and_the_plant_keeps_its_own_time():
    own = tank(noise=2e-3, time=100.0 + 0.5 * np.arange(240))
    plant = prepared(own)
    np.testing.assert_allclose(plant.runs[0].time, 0.5 * np.arange(240))
    assert own.runs[0].time[0] == 100.0


def test_untrusted_readings_that_are_no_number_count_nothing():
    own = without_gap()
    own.runs[0].measured[0, 10:20] = np.nan
    own.runs[0].trusted[0, 10:20] = False
    for plant in (own, prepared(own)):
        problem = FittingProblem(plant)
        outputs = noise_weighted(plant, 0, plant.outputs({"c": np.array([0.02])}, [0])[0])
        residual = problem.residual(0, outputs.reshape(-1, 1))
        np.testing.assert_array_equal(residual[10:20], 0.0)
        assert np.all(np.abs(residual) < 200)


@pytest.mark.parametrize(
    ("given", "scale"),
    [
        ({"nominal": -3.0, "trials": (2.0,)}, 3.0),
        ({"trials": (-2.0,)}, 2.0),
        ({"nominal": 3.0, "trials": (2.0,), "scale": 7.0}, 7.0),
        ({}, 1.0),
    ],
)
def test_a_parameter_without_a_scale_has_its_usual_size(given, scale):
    assert FreeParameter(symbol="a", unit="", low=-5.0, high=5.0, **given).scale == scale
