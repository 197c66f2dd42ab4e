"""Noise floor: what noise alone leaves of the gap, from differences of the best model's residuals.

The noise that a plant states is estimated from few readings at rest, or is not known at all. An error
of some percent would look like a gap, or hide one. Half the mean square of differences (Rice 1984) over
one, two and four readings tells white noise from what changes slowly: white noise is the same over any
lag, a misfit or a ripple grows with the lag, and the law of its growth leads back to lag 0.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.gap.model.grey_box import GreyBox
from identification.gap.reduce.settings import ReductionSettings

MEDIAN_TO_SD = 1.4826
"""Standard deviation of a normal distribution over the median of its absolute values."""


LAGS = (1, 2, 4)
"""Lags of the differences [readings]: doubled twice, so that their growth shows its law."""


def squared_differences(
    plant: GreyBox, residuals: Sequence[NDArray], lag: int, settings: ReductionSettings
) -> tuple[list[NDArray], list[NDArray]]:
    """Squared differences of trusted residuals, and where they count, at the later sample.

    Samples that are not trusted are passed over: channels may have different sampling periods.

    Args:
        plant: the plant with its recordings.
        residuals: per run (channels, samples) [noise deviations].
        lag: number of trusted readings from the earlier to the later one.
        settings: limit of jumps.

    Returns:
        Squares [noise variances] and boolean masks, per run (channels, samples) each.
    """
    found = [
        _differences(residual, run.trusted, lag)
        for residual, run in zip(residuals, plant.runs, strict=True)
    ]
    changes, pairs = [change for change, _ in found], [pair for _, pair in found]
    together = np.concatenate(changes, axis=1), np.concatenate(pairs, axis=1)
    limits = np.array(
        [_jump_limit(change[pair], settings) for change, pair in zip(*together, strict=True)]
    )
    kept = [
        pair & (np.abs(change) <= limits[:, None]) for change, pair in zip(changes, pairs, strict=True)
    ]
    return [keep * change**2 for keep, change in zip(kept, changes, strict=True)], kept


def noise_ratios(variograms: NDArray, squares: NDArray, settings: ReductionSettings) -> NDArray:
    """Noise standard deviation relative to the channel's, (draws, channels) [1]; row 0 is the estimate.

    The white part of the residual is the noise. Where it is not the larger part of what changes from one
    reading to the next, the noise itself is coloured: the ratio is 1, but no more than all that is left.

    Args:
        variograms: half the mean squared differences of the best model's residuals over LAGS, (lags,
            draws, channels) [noise variances].
        squares: mean squares of these residuals, (draws, channels) [noise variances].
        settings: when noise is white.
    """
    first, fourth = variograms[0], variograms[-1]
    growth = fourth / np.maximum(first, np.finfo(float).tiny) - 1.0
    allowed = np.maximum(
        settings.white_noise_tolerance, settings.white_noise_deviations * np.std(growth, axis=0)
    )
    white = np.abs(growth[0]) <= allowed
    law, at_zero = _at_lag_zero(variograms)
    slow = (law[0] >= settings.least_slow_growth) & (at_zero[0] >= settings.least_white_share * first[0])
    stated = np.where(squares > 0, np.minimum(1.0, np.sqrt(squares)), 1.0)
    seen = np.sqrt(np.maximum(np.where(white, first, at_zero), 0.0))
    seen = np.where(seen > 0, seen, stated)
    return np.where((white | slow) & (first[0] > 0), seen, stated)


def _at_lag_zero(variograms: NDArray) -> tuple[NDArray, NDArray]:
    """Law of the growth, and the variogram without what grows, (draws, channels) each [1, variances].

    Noise plus b lag^p grows 2^p times as much from two to four readings as from one to two: twice for a
    rough course (p = 1), four times for a smooth one (p = 2), less than once for noise that is itself
    correlated over two readings. variograms: (lags, draws, channels) [noise variances].
    """
    first, second, fourth = variograms
    early = np.maximum(second - first, np.finfo(float).tiny)
    law = (fourth - second) / early
    return law, first - early / (np.clip(law, 2.0, 4.0) - 1.0)


def _differences(residual: NDArray, trusted: NDArray, lag: int) -> tuple[NDArray, NDArray]:
    """Differences over `lag` trusted readings, and whether a sample has one, (channels, samples) each.

    residual: (channels, samples) [noise deviations]. trusted: boolean (channels, samples).
    """
    changes, pairs = np.zeros(residual.shape), np.zeros(residual.shape, dtype=bool)
    for change, pair, own, counted in zip(changes, pairs, residual, trusted, strict=True):
        places = np.flatnonzero(counted)
        change[places[lag:]] = own[places[lag:]] - own[places[:-lag]]
        pair[places[lag:]] = True
    return changes, pairs


def _jump_limit(changes: NDArray, settings: ReductionSettings) -> float:
    """Largest difference that is no jump, from the standard deviation of those below the limit.

    changes: (differences,) [noise deviations].
    """
    median = float(np.median(np.abs(changes))) if len(changes) else 0.0
    limit = settings.jump_limit * MEDIAN_TO_SD * median
    for _ in range(settings.jump_iterations):
        kept = changes[np.abs(changes) <= limit]
        if not len(kept):
            return np.inf
        limit = settings.jump_limit * float(np.sqrt(np.mean(kept**2)))
    return limit
