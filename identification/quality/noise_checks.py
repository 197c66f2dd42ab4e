"""Checks of a channel's noise: is it normal, white and its own?

As for the readings, a departure counts if it is significant and large enough to matter.
"""

from identification.quality.assessment import QualityAssessment
from identification.quality.channel import SIGNIFICANCE, ChannelAssessment
from identification.quality.correlation_tests import PairCorrelation, WhitenessTest
from identification.quality.judgements import (
    SEVERITY,
    Judgement,
    graded_status,
    judgement_of,
    p_value_text,
)

EFFECT_LEVELS = (0.1, 0.3)
"""Cohen's small and medium effects: of w for normality, of correlations otherwise."""

INFLATION_LEVELS = (3.0, 10.0)
"""Variance of a mean relative to that with independent samples."""


def check_normality(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    """Do the counts per code follow a normal distribution?"""
    found = channel.normality
    if found.degrees < 1:
        return Judgement("note", "the record holds too few codes to test their distribution")
    return judgement_of(
        graded_status(found.effect, EFFECT_LEVELS) if found.probability < SIGNIFICANCE else "good",
        f"counts per code against normal: chi-square {found.statistic:.1f} with {found.degrees} "
        f"degrees of freedom, {p_value_text(found.probability)}, effect {found.effect:.2f}, "
        f"kurtosis {channel.description.kurtosis:.2f}, skewness {channel.description.skewness:.2f}",
        "look at the probability plot, and trust no interval that assumes normal noise",
    )


def check_whiteness(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    """Are the samples independent of each other?"""
    found = channel.whiteness
    if found is None:
        return Judgement("note", "the signal never changes, so there is nothing to correlate")
    frequency = found.peak_frequency / (2 * quality.period)
    return judgement_of(
        _dependence_level(found) if found.probability < SIGNIFICANCE else "good",
        f"Ljung-Box {p_value_text(found.probability)}, greatest autocorrelation {found.peak:.3f}, a "
        "mean "
        f"has {found.inflation:.2f} times the variance of independent samples",
        f"most power is near {frequency:.3g} Hz: mains hum if that is 50 or 60 Hz, else a filter or a "
        "moving signal",
    )


def _dependence_level(found: WhitenessTest) -> str:
    peak, inflation = (
        graded_status(found.peak, EFFECT_LEVELS),
        graded_status(found.inflation, INFLATION_LEVELS),
    )
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
