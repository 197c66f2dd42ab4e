"""Section 4 for one recording: `assess_recording`, and the offsets that a calibration may subtract."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from types import MappingProxyType

import numpy as np
from scipy.stats import norm

from epv_env.plant.channels import SENSORS, Sensor
from identification.noise import rounding_error
from identification.quality.channel import ChannelAssessment, assess_channel
from identification.recordings.recording import CHANNELS, PRESSURES, UNITS, CampaignError, Recording

LEAST_SAMPLES = 250
"""Shortest record [samples]: half a second at 500 Hz. Fewer do not show the noise."""

FINE: Mapping[str, float] = MappingProxyType({})
"""Steps of a campaign without coarse ones."""


@dataclass(frozen=True, kw_only=True)
class SensorOffset:
    """Reading of a sensor at the start of a record at rest, less what a perfect sensor reads [SI]."""

    value: float
    """[SI]."""
    error: float
    """Standard error of the value [SI]."""


@dataclass(frozen=True, kw_only=True)
class QualityAssessment:
    """Statistics of the channels of one steady recording [A, V, bar]."""

    name: str
    """Of the recording."""
    period: float
    """[s]."""
    samples: int
    """Of each channel."""
    channels: Mapping[str, ChannelAssessment]
    """By name, in the order of Table 1."""
    correlations: Mapping[tuple[str, str], float]
    """Of the detrended signals of each pair of channels that change (Table 4)."""

    @property
    def coil_off(self) -> bool:
        """Whether no current flows: at least one of I and U is zero within its accuracy."""
        return any(self.channels[name].within_accuracy for name in ("I", "U"))

    @property
    def vented(self) -> bool:
        """Whether at least two of three pressures are ambient within their accuracy."""
        return sum(self.channels[name].within_accuracy for name in PRESSURES) >= 2

    @property
    def at_rest(self) -> bool:
        """Whether every channel is steady, and within the accuracy of its rest value."""
        return all(channel.at_rest for channel in self.channels.values())


def assess_recording(
    recording: Recording,
    environment_pressure: float,
    steps: Mapping[str, float] = FINE,
    sensors: Mapping[str, Sensor] = SENSORS,
) -> QualityAssessment:
    """Statistics of a steady recording.

    environment_pressure: p_env [Pa absolute]. steps: coarse steps of the campaign's readings by channel
    [SI], which a record at rest may not show. sensors: by channel [bar, A, V]. Raises CampaignError for
    a record of fewer than `LEAST_SAMPLES`.
    """
    if len(recording) < LEAST_SAMPLES:
        raise CampaignError(
            f"{recording.name}: {len(recording)} samples; the statistics of section 4 need "
            f"{LEAST_SAMPLES} or more: record 5 s of steady state"
        )
    channels = {
        name: assess_channel(
            name,
            recording.channel(name) / UNITS[name][1],
            period=recording.period,
            rest=environment_pressure / UNITS[name][1] if name in PRESSURES else 0.0,
            step=steps.get(name, 0.0) / UNITS[name][1],
            sensor=sensors[name],
        )
        for name in CHANNELS
    }
    moving = [channel for channel in channels.values() if channel.moves]
    return QualityAssessment(
        name=recording.name,
        period=recording.period,
        samples=len(recording),
        channels=channels,
        correlations={
            (a.name, b.name): float(np.corrcoef(a.residual, b.residual)[0, 1])
            for a, b in combinations(moving, 2)
        },
    )


def sensor_offsets(quality: QualityAssessment) -> dict[str, SensorOffset]:
    """Offset of each channel at time 0, where a drift starts; a calibration may subtract it.

    Empty unless the record is at rest: elsewhere nothing separates an offset from the signal.
    """
    if not quality.at_rest:
        return {}
    offsets = {}
    for name, channel in quality.channels.items():
        size, line = UNITS[name][1], channel.trend
        scatter = float(line.intercept_stderr) if channel.moves else 0.0
        lasting = (
            0.0 if channel.dithered else rounding_error(channel.quantum)
        )  # noise does not average it
        error = math.hypot(scatter, lasting) * size
        offsets[name] = SensorOffset(value=(float(line.intercept) - channel.rest) * size, error=error)
    return offsets


def white_noise_band(samples: int) -> float:
    """Half width of the band that holds 95 % of the correlations of independent white signals."""
    return float(norm.isf(0.025) / np.sqrt(samples))
