"""Errors of a cause's form in a planned run: a random factor on its effect in every short segment.

The true form of a cause never equals ours exactly. In each segment the effect may be off by a Gaussian
random share, which is integrated out in closed form.
"""

import numpy as np
from numpy.typing import NDArray


def segments(series: NDArray, period: float, duration: float) -> NDArray:
    """A series (samples,) of any unit in segments (segments, samples of one), the last one zero-padded.

    period: of sampling [s]. duration: of a segment [s].
    """
    length = max(1, round(duration / period))
    count = -(-len(series) // length)
    padded = np.zeros(count * length)
    padded[: len(series)] = series
    return padded.reshape(count, length)


def segment_columns(columns: NDArray, period: float, duration: float) -> NDArray:
    """Columns (samples, n) of any unit in segments, (segments, samples of one, n).

    period: of sampling [s]. duration: of a segment [s].
    """
    return np.stack([segments(column, period, duration) for column in columns.T], axis=2)


def explained_by_form_errors(
    columns: NDArray, errors: NDArray, channels: int, period: float, duration: float
) -> NDArray:
    """Part of the products of columns that errors of form explain, (n, n) [1].

    Args:
        columns: predictions and derivatives, (channels x samples, n) [noise deviations].
        errors: effects of causes times the size of their form error, (channels x samples, causes).
        channels: number of channels.
        period: of sampling [s].
        duration: of a segment, in which an error is constant [s].
    """
    total = np.zeros((columns.shape[1], columns.shape[1]))
    for own_columns, own_errors in zip(
        np.split(columns, channels), np.split(errors, channels), strict=True
    ):
        parts = segment_columns(own_columns, period, duration)
        effects = segment_columns(own_errors, period, duration)
        gram = np.eye(effects.shape[2]) + effects.transpose(0, 2, 1) @ effects
        products = np.linalg.solve(np.linalg.cholesky(gram), effects.transpose(0, 2, 1) @ parts)
        flat = products.reshape(-1, products.shape[2])
        total += flat.T @ flat
    return total
