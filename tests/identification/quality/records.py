"""Synthetic steady records: a perfect bench at rest, and one with a fault."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.channels import SENSORS
from identification.recordings.recording import CHANNELS, UNITS, Recording
from tests.identification.quality.printed import TREND_OFFSETS

PERIOD = 1 / 2000
AMBIENT = 1e5


def readings(name: str, value: NDArray | float, rng: np.random.Generator, samples: int) -> NDArray:
    """What a channel of the bench shows of a true value [A, V or bar], (samples,)."""
    return SENSORS[name].measure(value + np.zeros(samples), rng.standard_normal(samples))


def rest_record(seed: int, samples: int = 10_000) -> Recording:
    """The report's bench at rest: Table 2's offsets, Table 3's noise, 12 bits."""
    rng = np.random.default_rng(seed)
    signals: dict[str, Any] = {
        name: UNITS[name][1] * readings(name, TREND_OFFSETS[name], rng, samples) for name in CHANNELS
    }
    return Recording(name="rest", role="quality", period=PERIOD, sigma_S=np.zeros(samples), **signals)


def with_channel(recording: Recording, name: str, signal: NDArray) -> Recording:
    """The record with one channel exchanged; signal (samples,) in A, V or bar."""
    return replace(recording, **{name: UNITS[name][1] * signal})
