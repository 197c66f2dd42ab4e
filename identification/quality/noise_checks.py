"""Checks of a channel's noise: is it normal, white and its own?

As for the readings, a departure counts if it is significant and large enough to matter.
"""

from identification.quality.assess import Quality
from identification.quality.channel import SIGNIFICANCE, Channel
from identification.quality.dependence import Pair, Whiteness
from identification.quality.levels import SEVERITY, Judgement, judgement, level, probability

EFFECT_LEVELS = (0.1, 0.3)
"""Cohen's small and medium effects: of w for normality, of correlations otherwise."""

INFLATION_LEVELS = (3.0, 10.0)
"""Variance of a mean relative to that with independent samples."""


def normality(quality: Quality, channel: Channel) -> Judgement:
    """Do the counts per code follow a normal distribution?"""
    found = channel.normality
    if found.degrees < 1:
        return Judgement("note", "the record holds too few codes to test their distribution")
    return judgement(
        level(found.effect, EFFECT_LEVELS) if found.probability < SIGNIFICANCE else "good",
        f"counts per code against normal: chi-square {found.statistic:.1f} with {found.degrees} "
        f"degrees of freedom, {probability(found.probability)}, effect {found.effect:.2f}, "
        f"kurtosis {channel.description.kurtosis:.2f}, skewness {channel.description.skewness:.2f}",
        "look at the probability plot, and trust no interval that assumes normal noise",
    )


def whiteness(quality: Quality, channel: Channel) -> Judgement:
    """Are the samples independent of each other?"""
    found = channel.whiteness
    if found is None:
        return Judgement("note", "the signal never changes, so there is nothing to correlate")
    frequency = found.peak_frequency / (2 * quality.period)
    return judgement(
        _dependence_level(found) if found.probability < SIGNIFICANCE else "good",
        f"Ljung-Box {probability(found.probability)}, greatest autocorrelation {found.peak:.3f}, a mean "
        f"has {found.inflation:.2f} times the variance of independent samples",
        f"most power is near {frequency:.3g} Hz: mains hum if that is 50 or 60 Hz, else a filter or a "
        "moving signal",
    )


def _dependence_level(found: Whiteness) -> str:
    peak, inflation = level(found.peak, EFFECT_LEVELS), level(found.inflation, INFLATION_LEVELS)
    return max(peak, inflation, key=SEVERITY.index)


def correlation(quality: Quality, channel: Channel) -> Judgement:
    """Is the noise independent of the other channels', at any lag?"""
    partners = _partners(quality, channel.name)
    if not partners:
        return Judgement("note", "no other channel changes, so there is nothing to correlate with")
    other, pair = max(partners.items(), key=lambda item: abs(item[1].peak))
    family_wise = min(1.0, pair.peak_probability * len(quality.pairs))
    return judgement(
        level(abs(pair.peak), EFFECT_LEVELS) if family_wise < SIGNIFICANCE else "good",
        f"greatest cross-correlation {pair.peak:.3f}, with {other} at a lag of "
        f"{1e3 * quality.period * abs(pair.peak_lag):.3g} ms, family-wise {probability(family_wise)}",
        "look for crosstalk, a shared ground or a shared supply",
    )


def _partners(quality: Quality, name: str) -> dict[str, Pair]:
    return {
        first if second == name else second: pair
        for (first, second), pair in quality.pairs.items()
        if name in (first, second)
    }
