"""Checks of a channel's noise: is it normal, white and its own?

As for the readings, a departure counts if it is significant and large enough to matter.
"""

from identification.quality.assessment import QualityAssessment
from identification.quality.channel import ChannelAssessment
from identification.quality.correlation_tests import PairCorrelation, WhitenessTest
from identification.quality.judgements import (
    SEVERITY,
    Judgement,
    graded_status,
    judgement_of,
    p_value_text,
)
from identification.quality.settings import QualitySettings


def check_normality(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    """Do the counts per code follow a normal distribution?"""
    test = channel.normality
    if test.degrees < 1:
        return Judgement("note", "the record holds too few codes to test their distribution")
    return judgement_of(
        graded_status(test.effect, quality.settings.effect_levels)
        if test.probability < quality.settings.significance
        else "good",
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
        _dependence_status(test, quality.settings)
        if test.probability < quality.settings.significance
        else "good",
        f"Ljung-Box {p_value_text(test.probability)}, greatest autocorrelation {test.peak:.3f}, a "
        f"mean has {test.inflation:.2f} times the variance of independent samples",
        f"most power is near {frequency:.3g} Hz: mains hum if that is 50 or 60 Hz, else a filter or a "
        "moving signal",
    )


def _dependence_status(test: WhitenessTest, settings: QualitySettings) -> str:
    """The worse status of the greatest autocorrelation and of the variance of a mean."""
    peak = graded_status(test.peak, settings.effect_levels)
    inflation = graded_status(test.inflation, settings.inflation_levels)
    return max(peak, inflation, key=SEVERITY.index)


def check_correlation(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    """Is the noise independent of the other channels', at any lag?"""
    partners = _partners(quality, channel.name)
    if not partners:
        return Judgement("note", "no other channel changes, so there is nothing to correlate with")
    other, pair = max(partners.items(), key=lambda item: abs(item[1].peak))
    family_wise = min(1.0, pair.peak_probability * len(quality.pairs))
    return judgement_of(
        graded_status(abs(pair.peak), quality.settings.effect_levels)
        if family_wise < quality.settings.significance
        else "good",
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
