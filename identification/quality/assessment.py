"""Section 4 for one recording: `assess_recording`, and the offsets that a calibration may subtract."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from types import MappingProxyType

from epv_env.plant.channels import SENSORS, Sensor
from identification.quality.channel import ChannelAssessment, assess_channel
from identification.quality.noise_tests import PairCorrelation, assess_correlation
from identification.readings_noise import rounding_error
from identification.recordings.recording import CHANNELS, PRESSURES, UNITS, CampaignError, Recording

LEAST_SAMPLES = 250
"""Shortest record [samples]: half a second at 500 Hz. Fewer do not show the noise's distribution."""
GREATEST_LAG = 0.1
"""Greatest lag of the correlations [s]."""
SAMPLES_PER_LAG = 20
"""Samples that a record needs for each lag; with fewer, Ljung-Box alarms too often on white noise."""

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
    pairs: Mapping[tuple[str, str], PairCorrelation]
    """Of all channels that change."""

    @property
    def adjusted(self) -> dict[tuple[str, str], float]:
        """p-values of the correlations at lag 0, family-wise over all pairs (Bonferroni)."""
        return {
            names: min(1.0, len(self.pairs) * pair.probability) for names, pair in self.pairs.items()
        }

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

    @property
    def lags(self) -> int:
        """Greatest lag of the correlations [samples]."""
        return greatest_lag(self.samples, self.period)


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
        name: _channel(recording, sensors[name], name, environment_pressure, steps.get(name, 0.0))
        for name in CHANNELS
    }
    pairs = _pairs(channels, greatest_lag(len(recording), recording.period))
    return QualityAssessment(
        name=recording.name,
        period=recording.period,
        samples=len(recording),
        channels=channels,
        pairs=pairs,
    )


def sensor_offsets(quality: QualityAssessment) -> dict[str, SensorOffset]:
    """Offset of each channel, which a calibration may subtract.

    Empty unless the record is at rest: elsewhere nothing separates an offset from the signal.
    """
    if not quality.at_rest:
        return {}
    return {name: _offset(channel) for name, channel in quality.channels.items()}


def _offset(channel: ChannelAssessment) -> SensorOffset:
    """Of the trend's line at time 0, since a drift starts with the recording.

    Rounding errors that noise does not average out count as error of the offset.
    """
    size = UNITS[channel.name][1]
    value = channel.trend.offset - channel.rest
    scatter = 0.0 if channel.whiteness is None else channel.trend.offset_error
    lasting = 0.0 if channel.dithered else rounding_error(channel.quantum)
    return SensorOffset(value=value * size, error=math.hypot(scatter, lasting) * size)


def greatest_lag(samples: int, period: float) -> int:
    """Greatest lag at which correlations are computed [samples]; period: between samples [s]."""
    return max(1, min(round(GREATEST_LAG / period), samples // SAMPLES_PER_LAG))


def _channel(
    recording: Recording,
    sensor: Sensor,
    name: str,
    environment_pressure: float,
    step: float,
) -> ChannelAssessment:
    size = UNITS[name][1]
    return assess_channel(
        name,
        recording.channel(name) / size,
        period=recording.period,
        rest=environment_pressure / size if name in PRESSURES else 0.0,
        lags=greatest_lag(len(recording), recording.period),
        step=step / size,
        sensor=sensor,
    )


def _pairs(
    channels: Mapping[str, ChannelAssessment], lags: int
) -> dict[tuple[str, str], PairCorrelation]:
    moving = [name for name, channel in channels.items() if channel.whiteness is not None]
    return {
        (first, second): assess_correlation(channels[first].residual, channels[second].residual, lags)
        for first, second in combinations(moving, 2)
    }
