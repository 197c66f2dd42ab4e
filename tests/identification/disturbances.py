"""What real benches add to recordings: slow ripple on the signals, and coarse steps of the readings."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from epv_env.plant.channels import SENSORS
from identification.recordings.recording import CHANNELS, PRESSURES, UNITS, Campaign, Recording


def add_ripple(
    campaign: Campaign, *, sd: Mapping[str, float], correlation_time: float, seed: int
) -> Campaign:
    """The campaign with a slow random ripple on some channels, as supply pulsation or wiring gives it.

    An Ornstein-Uhlenbeck process that is stationary from the first sample, in whole steps of the
    sensor's converter. sd: its standard deviation by channel, in the channel's unit [bar, A, V].
    correlation_time: in which its autocorrelation falls to 1/e [s]. seed: each recording and channel
    has a generator of its own.
    """
    recordings = []
    for number, recording in enumerate(campaign.recordings):
        changed = {}
        for channel in sd:
            rng = np.random.default_rng([seed, number, CHANNELS.index(channel)])
            ripple = sd[channel] * _ornstein_uhlenbeck(
                rng.standard_normal(len(recording)), recording.period / correlation_time
            )
            steps = _in_steps(ripple, SENSORS[channel].resolution)
            changed[channel] = recording.channel(channel) + steps * UNITS[channel][1]
        recordings.append(_changed(recording, changed))
    return replace(campaign, recordings=tuple(recordings))


def round_pressures(campaign: Campaign, step: float) -> Campaign:
    """The campaign with p1, p2 and p3 in multiples of `step` [bar], as a vehicle's bus gives them."""
    return replace(
        campaign,
        recordings=tuple(
            _changed(
                recording,
                {
                    name: _in_steps(recording.channel(name) / UNITS[name][1], step) * UNITS[name][1]
                    for name in PRESSURES
                },
            )
            for recording in campaign.recordings
        ),
    )


def _changed(recording: Recording, signals: Mapping[str, Any]) -> Recording:
    """With other signals, by channel, (samples,) [SI]; no longer what a file holds."""
    return replace(recording, sha256="", **signals)


def _in_steps(values: NDArray, step: float) -> NDArray:
    return np.rint(values / step) * step


def _ornstein_uhlenbeck(white: NDArray, period: float) -> NDArray:
    """A process of variance 1 from white noise, (samples,); period: per correlation time."""
    memory = np.exp(-period)
    drive = np.sqrt(1.0 - memory**2) * white
    drive[0] = white[0]
    return np.asarray(lfilter([1.0], [1.0, -memory], drive))
