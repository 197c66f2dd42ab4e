"""Channels of different rates and jittering times on one uniform grid, without delay or aliases.

Three steps. A cubic spline through the samples at their true times gives values on a fine uniform grid;
it takes jitter out. A symmetric low-pass (Kaiser window) on the fine grid removes what the lower of both
rates cannot carry; being symmetric about each sample it delays nothing. Every n-th value is kept.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import firwin, kaiserord, oaconvolve

from identification.importing.settings import IMPORT, ImportSettings


def usual_rate(time: NDArray) -> float:
    """Samples per second of times (samples,) [s] that may jitter [1/s]."""
    return (len(time) - 1) / float(time[-1] - time[0])


def resampled(
    time: NDArray, values: NDArray, grid: NDArray, settings: ImportSettings = IMPORT
) -> NDArray:
    """Values on a uniform grid, (grid,), in the unit of `values`.

    Args:
        time: of the samples, increasing, (samples,) [s]; it covers the grid.
        values: (samples,), any unit.
        grid: wanted times, uniform, (grid,) [s].
        settings: pass- and stopband, attenuation.
    """
    period = float(grid[-1] - grid[0]) / (len(grid) - 1)
    own = usual_rate(time)
    dense = max(1, math.ceil(settings.resampling_margin * own * period))
    taps = _low_pass(min(own, 1.0 / period), dense / period, settings)
    half = len(taps) // 2
    fine = grid[0] + np.arange(-half, dense * (len(grid) - 1) + half + 1) * (period / dense)
    filtered = oaconvolve(_mirrored_spline(time, values, fine), taps, mode="valid")
    return np.asarray(filtered)[::dense]


def _low_pass(rate: float, fine_rate: float, settings: ImportSettings) -> NDArray:
    """Taps of a symmetric filter of unit gain, odd in number; rates [1/s]."""
    width = (settings.stopband - settings.passband) * rate
    count, beta = kaiserord(settings.stop_attenuation, width / (0.5 * fine_rate))
    cut = 0.5 * (settings.passband + settings.stopband) * rate
    window: Any = ("kaiser", beta)
    return np.asarray(firwin(count | 1, cut, window=window, fs=fine_rate))


def _mirrored_spline(time: NDArray, values: NDArray, at: NDArray) -> NDArray:
    """The spline through the samples; beyond the ends, where the filter looks, their mirror image."""
    inside = time[0] + np.abs(at - time[0])
    inside = time[-1] - np.abs(time[-1] - inside)
    return CubicSpline(time, values)(np.clip(inside, time[0], time[-1]))
