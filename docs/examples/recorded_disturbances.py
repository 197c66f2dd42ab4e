"""Disturbances under which recorded plants are diagnosed again: wrong noise, and a slow ripple."""

from copy import copy
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from identification.gap.ode_plant import OdePlant
from identification.gap.prepared_plant import prepared

NOISE_FACTORS = {"sigma=0.3": 0.3, "sigma=3": 3.0}
"""Factors by which the noise is stated too small or too large [1]."""

RIPPLE = "ripple"
DISTURBANCES = (*NOISE_FACTORS, RIPPLE)

RIPPLE_SIZE = 2.0
"""Standard deviation of the ripple [noise deviations]."""

RIPPLE_PERIODS = 10.0
"""Sampling periods in which the autocorrelation of the ripple falls to 1/e [1]."""


def disturbed(plant: OdePlant, disturbance: str, seed: int) -> OdePlant:
    """The plant with one of DISTURBANCES; its noise is the given one, or what its readings show.

    seed: of the ripple, an Ornstein-Uhlenbeck process on every channel.
    """
    noise = [channel.known_noise for channel in prepared(plant).channels]
    other = copy(plant)
    if disturbance in NOISE_FACTORS:
        factor = NOISE_FACTORS[disturbance]
        other.channels = tuple(
            replace(channel, noise=factor * known)
            for channel, known in zip(plant.channels, noise, strict=True)
        )
        return other
    rng, memory = np.random.default_rng(seed), np.exp(-1.0 / RIPPLE_PERIODS)
    runs = []
    for run in plant.runs:
        white = rng.standard_normal(run.measured.shape)
        white[:, 1:] *= np.sqrt(1.0 - memory**2)
        ripple = lfilter([1.0], [1.0, -memory], white)
        size = RIPPLE_SIZE * np.array(noise)[:, None]
        runs.append(replace(run, measured=run.measured + size * ripple))
    other.runs = tuple(runs)
    return other
