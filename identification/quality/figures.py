"""Figures 4 to 9 of the report for one assessed recording, each with all channels."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy import stats

from identification.quality.assessment import QualityAssessment
from identification.quality.channel import ChannelAssessment
from identification.quality.noise_tests import WhitenessTest, white_noise_band

MARK = {"color": "tab:blue", "linewidth": 0.8}
"""Line of a computed curve."""

REFERENCE = {"color": "tab:red", "linewidth": 1.0}
"""Line of a fit or a normal distribution."""

BAND = {"color": "tab:orange", "alpha": 0.3, "linewidth": 0}
"""Band of white noise."""

TICKS = (0.001, 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 0.999)
"""Probabilities on the axis of a normal probability plot."""


def signals(quality: QualityAssessment) -> Figure:
    """Readings over time, with the line of the trend (Figure 4)."""
    figure = Figure(figsize=(9, 7.5), layout="constrained")
    rows = figure.subplots(len(quality.channels), 1, sharex=True)
    time = np.arange(quality.samples) * quality.period
    for axes, channel in zip(rows, quality.channels.values(), strict=True):
        axes.plot(time, channel.readings, color="tab:blue", linewidth=0.3)
        axes.plot(time[[0, -1]], channel.trend.at(time[[0, -1]]), **REFERENCE)
        axes.set_ylabel(f"{channel.name} [{channel.unit}]")
    rows[-1].set_xlabel("time [s]")
    figure.align_ylabels()
    return figure


def probability_plots(quality: QualityAssessment) -> Figure:
    """Detrended signals on a normal probability scale (Figure 5)."""
    figure, panels = _grid(quality, "probability")
    for axes, channel, _ in panels:
        plot: Any = stats.probplot(1e3 * channel.residual)
        (quantiles, ordered), (slope, offset, _) = plot
        axes.plot(ordered, quantiles, ".", markersize=2, color="tab:blue", rasterized=True)
        axes.plot(offset + slope * quantiles[[0, -1]], quantiles[[0, -1]], **REFERENCE)
        axes.set_yticks(stats.norm.ppf(TICKS), [f"{tick:g}" for tick in TICKS])
        axes.set_xlabel(f"{channel.name} [m{channel.unit}]")
    return figure


def histograms(quality: QualityAssessment) -> Figure:
    """Detrended signals, a bar per step of the converter, and the normal density (Figure 6)."""
    figure, panels = _grid(quality, "density [1/unit of the axis]")
    for axes, channel, _ in panels:
        residual = 1e3 * channel.residual
        axes.hist(residual, bins=_bars(channel), density=True, color="tab:blue", alpha=0.6)
        grid = np.linspace(np.min(residual), np.max(residual), 300)
        axes.plot(grid, stats.norm.pdf(grid, scale=np.std(residual)), **REFERENCE)
        axes.set_xlabel(f"{channel.name} [m{channel.unit}]")
    return figure


def autocorrelations(quality: QualityAssessment) -> Figure:
    """Two-sided autocorrelations without their 1 at lag 0 (Figure 7)."""
    figure, panels = _grid(quality, "autocorrelation")
    for axes, channel, whiteness in panels:
        right = np.concatenate(([np.nan], whiteness.autocorrelation[1:]))
        _correlation(axes, np.concatenate((right[:0:-1], right)), quality, quality.samples)
        axes.set_title(channel.name)
        axes.set_xlabel("lag [ms]")
    return figure


def crosscorrelations(quality: QualityAssessment) -> Figure:
    """Two-sided cross-correlations of all pairs (Figure 8)."""
    rows = max(1, (len(quality.pairs) + 1) // 2)
    figure = Figure(figsize=(9, 0.5 + 1.7 * rows), layout="constrained")
    panels = figure.subplots(rows, 2).ravel()
    for axes, ((first, second), pair) in zip(panels, quality.pairs.items(), strict=False):
        _correlation(axes, pair.crosscorrelation, quality, pair.effective_samples)
        axes.set_title(f"{first} vs. {second}")
    for axes in panels[len(quality.pairs) :]:
        axes.remove()
    figure.supylabel("cross-correlation")
    figure.supxlabel("lag [ms]")
    return figure


def spectra(quality: QualityAssessment) -> Figure:
    """Power spectral densities with the 95 % band of white noise (Figure 9)."""
    figure, panels = _grid(quality, "density [dB re 1 unit² per rad/sample]")
    for axes, channel, whiteness in panels:
        spectrum = whiteness.spectrum
        level = 10 * np.log10(spectrum.white)
        axes.update_datalim([(0, level - 5), (1, level + 5)])
        axes.axhspan(*(10 * np.log10(spectrum.band)), **BAND)
        axes.plot(spectrum.frequency, 10 * np.log10(spectrum.density), **MARK)
        axes.set_title(f"{channel.name} [{channel.unit}]")
        axes.set_xlabel("frequency / Nyquist frequency")
    return figure


CAPTIONS: Mapping[Callable[[QualityAssessment], Figure], str] = {
    signals: "Acquired data with its trend.",
    probability_plots: (
        "Normal probability plots: normal noise lies on the line. Each column of points is one step of "
        "the converter."
    ),
    histograms: "Histograms, a bar per step of the converter, and normal densities.",
    autocorrelations: (
        "Two-sided autocorrelations without their value of 1 at lag 0; 95 % of the values of white "
        "noise lie in the band."
    ),
    crosscorrelations: (
        "Two-sided cross-correlations; 95 % of the values of independent signals lie in the band. At a "
        "positive lag the first signal follows the second."
    ),
    spectra: (
        "Power spectral densities by Welch's method; 95 % of the values of white noise lie in the band."
    ),
}
"""What draws each figure, and its caption."""


def _grid(
    quality: QualityAssessment, label: str
) -> tuple[Figure, list[tuple[Axes, ChannelAssessment, WhitenessTest]]]:
    """A panel per channel that changes, three in a row."""
    channels = [(c, c.whiteness) for c in quality.channels.values() if c.whiteness is not None]
    figure = Figure(figsize=(9, 5.4), layout="constrained")
    panels = figure.subplots(2, 3).ravel()
    for axes in panels[len(channels) :]:
        axes.remove()
    figure.supylabel(label)
    return figure, [(axes, *channel) for axes, channel in zip(panels, channels, strict=False)]


def _bars(channel: ChannelAssessment) -> list[float]:
    """Edges of the bars [m unit]: a step each, or a quarter of sigma if steps are finer."""
    quarter = 0.25 * channel.description.standard_deviation
    width = max(1, round(quarter / channel.quantum)) * channel.quantum if channel.quantum else quarter
    count = round(channel.description.range / width) + 1
    least = float(np.min(channel.residual))
    return (1e3 * (least + width * (np.arange(count + 1) - 0.5))).tolist()


def _correlation(axes: Axes, values: NDArray, quality: QualityAssessment, samples: float) -> None:
    """A two-sided correlation over the lag, and the band of independent signals."""
    half = len(values) // 2
    lag = 1e3 * quality.period * np.arange(-half, half + 1)
    band = white_noise_band(samples)
    limit = 1.2 * max(3 * band, float(np.nanmax(np.abs(values))))
    axes.axhspan(-band, band, **BAND)
    axes.plot(lag, values, **MARK)
    axes.set_ylim(-limit, limit)
