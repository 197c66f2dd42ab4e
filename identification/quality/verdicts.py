"""A result per channel and check: good, doubt or bad, with the figures and what to do.

A departure counts if it is statistically significant and large enough to matter. With 10 000 samples
the first alone would condemn every real bench.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from scipy import stats

from identification.quality.assessment import QualityAssessment
from identification.quality.channel import DRIFT_LEVELS, ChannelAssessment
from identification.quality.noise_tests import SIGNIFICANCE, PairCorrelation, WhitenessTest
from identification.recordings.recording import PRESSURES
from identification.report.page import Verdict

NOISE_LEVELS = (1.5, 4.0)
"""Standard deviation relative to Table 3's: 3.5 dB and 12 dB of its signal-to-noise ratio."""
QUIET_LEVELS = (5.0, 30.0)
"""Table 3's standard deviation relative to the record's, from which the noise is too small for a
sensor of this kind: a reading 100 times too small is as quiet."""
OUTLIER_LEVELS = (1.0, 2.0)
"""Outlier factor (eq. 18) relative to its limit."""
COARSE_STEP = 1.1
"""Converter step relative to Table 1's twelve bits from which the converter is too coarse."""
EFFECT_LEVELS = (0.1, 0.3)
"""Cohen's small and medium effects: of w for normality, of correlations otherwise."""
INFLATION_LEVELS = (3.0, 10.0)
"""Variance of a mean relative to that with independent samples."""

SEVERITY = ("note", "good", "doubt", "bad")
"""Statuses from harmless to worst; a note says that something could not be judged."""


class Judgement(NamedTuple):
    """What one check says."""

    status: str
    """One of SEVERITY."""
    text: str
    """One sentence: the figures and, unless good, what to do."""


def graded_status(value: float, levels: tuple[float, float]) -> str:
    """Good below the first level, bad from the second on, in doubt between."""
    return SEVERITY[1 + sum(value >= limit for limit in levels)]


def judgement_of(status: str, figures: str, advice: str) -> Judgement:
    """The figures and, unless all is well, what to do."""
    return Judgement(status, figures if status == "good" else f"{figures}; {advice}")


def p_value_text(value: float) -> str:
    """A p-value, which may be too small to print."""
    return f"p = {value:.2g}" if value > 1e-99 else "p < 1e-99"


def milli_text(channel: ChannelAssessment, value: float) -> str:
    """A small value in mA, mV or mbar."""
    return f"{1e3 * value:.3g} m{channel.unit}"


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
    significant = deviations > stats.norm.isf(SIGNIFICANCE / 2)
    return judgement_of(
        graded_status(ratio, DRIFT_LEVELS) if significant else "good",
        f"drift {milli_text(channel, channel.drift)} in {channel.duration:.3g} s, "
        f"{deviations:.1f} standard errors and {100 * ratio:.2g} % of the accuracy",
        "let the bench settle, look for a leak or a warming sensor, and record again",
    )


def check_noise(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    """Is the noise as small as the report's?"""
    deviation = channel.normality.standard_deviation
    ratio = deviation / channel.sensor.noise
    quiet = graded_status(1.0 / max(ratio, 1e-9), QUIET_LEVELS)
    if channel.dithered and quiet != "good":
        return Judgement(
            quiet,
            f"noise {milli_text(channel, deviation)} before rounding, only {ratio:.2g} times the usual; "
            "check the unit and scaling of the channel, since a reading too small has noise too small",
        )
    return judgement_of(
        graded_status(ratio, NOISE_LEVELS),
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
        "doubt" if ratio > COARSE_STEP or not channel.dithered else "good",
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
        graded_status(factor / limit, OUTLIER_LEVELS),
        f"greatest outlier {factor:.2f} standard deviations, at {at:.4g} s; 99.9 % of normal records "
        f"stay below {limit:.2f}",
        "look for switching interference and loose contacts, and record again",
    )


def check_normality(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    """Do the counts per code follow a normal distribution?"""
    test = channel.normality
    if test.degrees < 1:
        return Judgement("note", "the record holds too few codes to test their distribution")
    return judgement_of(
        graded_status(test.effect, EFFECT_LEVELS) if test.probability < SIGNIFICANCE else "good",
        f"counts per code against normal: chi-square {test.statistic:.1f} with {test.degrees} "
        f"degrees of freedom, {p_value_text(test.probability)}, effect {test.effect:.2f}, "
        f"kurtosis {channel.description.kurtosis:.2f}, skewness {channel.description.skewness:.2f}",
        "look at the probability plot, and trust no interval that assumes normal noise",
    )


def check_whiteness(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    """Are the samples independent of each other?"""
    test = channel.whiteness
    if test is None:
        return Judgement("note", "the signal never changes, so there is nothing to correlate")
    frequency = test.peak_frequency / (2 * quality.period)
    return judgement_of(
        _dependence_status(test) if test.probability < SIGNIFICANCE else "good",
        f"Ljung-Box {p_value_text(test.probability)}, greatest autocorrelation {test.peak:.3f}, a "
        f"mean has {test.inflation:.2f} times the variance of independent samples",
        f"most power is near {frequency:.3g} Hz: mains hum if that is 50 or 60 Hz, else a filter or a "
        "moving signal",
    )


def _dependence_status(test: WhitenessTest) -> str:
    """The worse status of the greatest autocorrelation and of the variance of a mean."""
    peak = graded_status(test.peak, EFFECT_LEVELS)
    inflation = graded_status(test.inflation, INFLATION_LEVELS)
    return max(peak, inflation, key=SEVERITY.index)


def check_correlation(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    """Is the noise independent of the other channels', at any lag?"""
    partners = _partners(quality, channel.name)
    if not partners:
        return Judgement("note", "no other channel changes, so there is nothing to correlate with")
    other, pair = max(partners.items(), key=lambda item: abs(item[1].peak))
    family_wise = min(1.0, pair.peak_probability * len(quality.pairs))
    return judgement_of(
        graded_status(abs(pair.peak), EFFECT_LEVELS) if family_wise < SIGNIFICANCE else "good",
        f"greatest cross-correlation {pair.peak:.3f}, with {other} at a lag of "
        f"{1e3 * quality.period * abs(pair.peak_lag):.3g} ms, family-wise {p_value_text(family_wise)}",
        "look for crosstalk, a shared ground or a shared supply",
    )


def _partners(quality: QualityAssessment, name: str) -> dict[str, PairCorrelation]:
    return {
        first if second == name else second: pair
        for (first, second), pair in quality.pairs.items()
        if name in (first, second)
    }


CHECKS: Mapping[str, Callable[[QualityAssessment, ChannelAssessment], Judgement]] = {
    "offset": check_offset,
    "trend": check_trend,
    "noise": check_noise,
    "resolution": check_resolution,
    "outliers": check_outliers,
    "normality": check_normality,
    "whiteness": check_whiteness,
    "correlation": check_correlation,
}
"""The checks by name; together they pass a perfect bench in 99 % of records or more."""


def check_results(quality: QualityAssessment, name: str) -> dict[str, Judgement]:
    """All checks of one channel; of one that never changes, only its offset and its resolution."""
    channel = quality.channels[name]
    checks = CHECKS if channel.whiteness else {"offset": check_offset, "resolution": check_resolution}
    return {check: judge(quality, channel) for check, judge in checks.items()}


def worst_status(results: Mapping[str, Judgement]) -> str:
    """Worst status among some results."""
    return max((result.status for result in results.values()), key=SEVERITY.index)


def channel_verdict(quality: QualityAssessment, name: str) -> Verdict:
    """One channel's verdict: what is not good about it, or its figures if all is."""
    results = check_results(quality, name)
    status = worst_status(results)
    if status == "good":
        text = f"no fault found; {results['offset'].text}; {results['noise'].text}."
    else:
        faults = {c: result.text for c, result in results.items() if result.status in ("doubt", "bad")}
        text = " ".join(f"{check}: {fault}." for check, fault in faults.items())
    return Verdict(status=status, text=f"{name}: {text}")
