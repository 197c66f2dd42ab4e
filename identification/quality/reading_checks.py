"""Checks of a channel's readings: offset, trend, noise, resolution, outliers.

A departure counts if it is statistically significant and large enough to matter. With 10 000 samples
the first alone would condemn every real bench.
"""

import numpy as np
from scipy import stats

from identification.quality.assessment import QualityAssessment
from identification.quality.channel import ChannelAssessment
from identification.quality.judgements import Judgement, graded_status, judgement_of, milli_text
from identification.recordings.recording import PRESSURES


def check_offset(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    """Is the mean reading within Table 1's accuracy of the rest value?"""
    pressure = channel.name in PRESSURES
    if not (quality.vented if pressure else quality.coil_off):
        return _no_offset(channel, "the chambers are not vented" if pressure else "the coil is on")
    return judgement_of(
        "good" if abs(channel.offset) <= channel.accuracy else "bad",
        f"offset {milli_text(channel, channel.offset)} against an accuracy of "
        f"±{milli_text(channel, channel.accuracy)}",
        f"{'vent this chamber' if pressure else 'switch the coil off'} and record again, "
        "or have the sensor calibrated",
    )


def _no_offset(channel: ChannelAssessment, reason: str) -> Judgement:
    mean = f"the mean reading is {channel.rest + channel.offset:.4g} {channel.unit}, but {reason}"
    return Judgement("note", f"{mean}, so no offset can be read off; record at rest for it")


def check_trend(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    """Is the drift over the record small against the accuracy?"""
    ratio, deviations = abs(channel.drift) / channel.accuracy, channel.trend_deviations
    significant = deviations > stats.norm.isf(channel.settings.significance / 2)
    return judgement_of(
        graded_status(ratio, channel.settings.drift_levels) if significant else "good",
        f"drift {milli_text(channel, channel.drift)} in {channel.duration:.3g} s, "
        f"{deviations:.1f} standard errors and {100 * ratio:.2g} % of the accuracy",
        "let the bench settle, look for a leak or a warming sensor, and record again",
    )


def check_noise(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    """Is the noise as small as the report's?"""
    deviation = channel.normality.standard_deviation
    ratio = deviation / channel.sensor.noise
    quiet = graded_status(1.0 / max(ratio, 1e-9), channel.settings.quiet_levels)
    if channel.dithered and quiet != "good":
        return Judgement(
            quiet,
            f"noise {milli_text(channel, deviation)} before rounding, only {ratio:.2g} times the usual; "
            "check the unit and scaling of the channel, since a reading too small has noise too small",
        )
    return judgement_of(
        graded_status(ratio, channel.settings.noise_levels),
        f"noise {milli_text(channel, deviation)} before rounding, {ratio:.2f} times the usual, "
        f"signal-to-noise ratio {channel.description.signal_to_noise:.1f} dB",
        "check shielding, ground and supply of the sensor",
    )


def check_resolution(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    """Do the readings move, in steps no coarser than Table 1's range in twelve bits?"""
    if channel.whiteness is None and channel.quantum:
        return judgement_of(
            "doubt",
            f"every sample reads {channel.readings[0]:.6g} {channel.unit}, in steps of "
            f"{milli_text(channel, channel.quantum)}, which may hide the noise of a live sensor",
            "record with finer steps, since a dead sensor would read the same",
        )
    if channel.whiteness is None:
        figures = f"every sample reads {channel.readings[0]:.6g} {channel.unit}"
        return judgement_of("bad", figures, "check the sensor's cable and the acquisition")
    if channel.longest_run > channel.run_limit:
        return _stands_still(quality, channel)
    ratio = channel.quantum / channel.sensor.resolution
    steps = channel.normality.standard_deviation / channel.quantum if channel.quantum else np.inf
    return judgement_of(
        "doubt" if ratio > channel.settings.coarse_step or not channel.dithered else "good",
        f"one step is {milli_text(channel, channel.quantum)}, {ratio:.2f} times the usual range in 12 "
        f"bits, and the noise is {steps:.2g} steps",
        "check the converter's range and bits, since rounding errors do not average out",
    )


def _stands_still(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    still, allowed = (1e3 * quality.period * n for n in (channel.longest_run, channel.run_limit))
    return judgement_of(
        "bad",
        f"one reading lasts {still:.3g} ms, where independent noise stays below {allowed:.3g} ms",
        "check the sensor's cable and the acquisition",
    )


def check_outliers(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    """Does the outlier factor (eq. 18) stay below what normal noise reaches?"""
    factor, limit = channel.description.outlier_factor, channel.outlier_limit
    at = int(np.argmax(np.abs(channel.residual))) * quality.period
    return judgement_of(
        graded_status(factor / limit, channel.settings.outlier_levels),
        f"greatest outlier {factor:.2f} standard deviations, at {at:.4g} s; 99.9 % of normal records "
        f"stay below {limit:.2f}",
        "look for switching interference and loose contacts, and record again",
    )
