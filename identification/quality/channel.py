"""Everything that section 4 says about one channel of a steady recording, in A, V or bar."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.sensors import SENSORS, Sensor
from identification.quality.correlation_tests import WhitenessTest, assess_whiteness
from identification.quality.normality import UNTESTED, Normality, assess_normality
from identification.quality.quantisation import longest_run, run_limit
from identification.quality.settings import QUALITY, QualitySettings
from identification.quality.statistics import (
    DescriptiveStatistics,
    Trend,
    descriptive_statistics,
    fit_trend,
    outlier_limit,
)
from identification.recordings.reading_steps import reading_step
from identification.recordings.recording import UNITS


@dataclass(frozen=True, kw_only=True)
class ChannelAssessment:
    """One channel's readings and what they show."""

    name: str
    """One of recording.CHANNELS."""
    readings: NDArray
    """(samples,) [A, V or bar]."""
    residual: NDArray
    """Readings minus the line of the trend, (samples,) [A, V or bar]."""
    duration: float
    """Of the record [s]."""
    rest: float
    """What a perfect sensor reads with the coil off and the chambers vented [A, V or bar]."""
    trend: Trend
    description: DescriptiveStatistics
    quantum: float
    """Step of the readings: as they show it, otherwise as the campaign does; 0.0 without a grid."""
    rounding: float
    """The step over the standard deviation; 0.0 for a signal that never changes."""
    longest_run: int
    """Longest run of one and the same reading [samples]."""
    run_limit: int
    """What independent readings do not reach."""
    normality: Normality
    whiteness: WhitenessTest | None
    """None for a signal that never changes."""
    settings: QualitySettings = QUALITY
    """What the channel was judged by."""
    sensor: Sensor
    """Range, accuracy and noise that it should have; Table 1's and Table 3's on the report's bench."""

    @property
    def unit(self) -> str:
        """A, V or bar."""
        return UNITS[self.name][0]

    @property
    def accuracy(self) -> float:
        """What the supplier allows a reading to be off (Table 1) [unit]."""
        return self.sensor.accuracy * self.sensor.high

    @property
    def offset(self) -> float:
        """Mean reading minus rest value [unit]; an offset error only if the record is at rest."""
        return float(np.mean(self.readings)) - self.rest

    @property
    def drift(self) -> float:
        """Change of the line over the record [unit]."""
        return self.trend.factor * self.duration

    @property
    def trend_deviations(self) -> float:
        """Slope over its standard error, the error enlarged for correlated noise; 0.0 if constant."""
        if self.whiteness is None:
            return 0.0
        enlarged = self.trend.factor_error * np.sqrt(max(1.0, self.whiteness.inflation))
        return float(abs(self.trend.factor) / enlarged)

    @property
    def within_accuracy(self) -> bool:
        """Whether the line stays within the accuracy of the rest value from start to end."""
        return abs(self.offset) + abs(self.drift) / 2 <= self.accuracy

    @property
    def at_rest(self) -> bool:
        """Whether the channel is steady, and within the accuracy of its rest value."""
        return self.within_accuracy and abs(self.drift) < self.settings.drift_levels[0] * self.accuracy

    @property
    def dithered(self) -> bool:
        """Whether noise moves the readings across steps enough for rounding errors to average out."""
        return self.normality.standard_deviation >= self.settings.least_dither * self.quantum

    @property
    def outlier_limit(self) -> float:
        """Outlier factor that normal noise stays below in a share `outlier_confidence` of records."""
        sigma = self.description.standard_deviation
        return outlier_limit(
            len(self.readings),
            rounding=self.rounding,
            confidence=self.settings.outlier_confidence,
            hidden=max(1.0, self.normality.standard_deviation / sigma) if sigma else 1.0,
        )


def assess_channel(
    name: str,
    readings: NDArray,
    *,
    period: float,
    rest: float,
    lags: int,
    step: float = 0.0,
    sensor: Sensor | None = None,
    settings: QualitySettings = QUALITY,
) -> ChannelAssessment:
    """Statistics of one channel.

    Args:
        name: one of recording.CHANNELS.
        readings: (samples,) [A, V or bar].
        period: time between samples [s].
        rest: what a perfect sensor reads at rest [A, V or bar].
        lags: greatest lag of the autocorrelation [samples].
        sensor: of the channel; None: the report's.
        step: of the readings, where a record that hardly moves cannot show it [A, V or bar].
    """
    sensor = sensor or SENSORS[name]
    time = np.arange(len(readings)) * period
    trend = fit_trend(time, readings)
    moves = bool(np.ptp(readings) > 0)
    residual = readings - trend.at(time) if moves else np.zeros_like(readings)
    description = descriptive_statistics(residual, greatest=sensor.high)
    step = reading_step(readings) or step
    rounding = step / description.standard_deviation if moves else 0.0
    return ChannelAssessment(
        name=name,
        readings=readings,
        residual=residual,
        duration=len(readings) * period,
        rest=rest,
        trend=trend,
        description=description,
        quantum=step,
        rounding=rounding,
        longest_run=longest_run(readings),
        run_limit=run_limit(readings, rounding=rounding, significance=settings.significance),
        normality=assess_normality(readings, trend.at(time), step, settings) if moves else UNTESTED,
        whiteness=assess_whiteness(residual, lags, settings) if moves else None,
        settings=settings,
        sensor=sensor,
    )
