"""Inputs between samples: held over each sampling period, and delayed where the plant reacts late.

The mean of a delayed input over a sub-step is taken from the input's integral. Without a delay it is the
sample itself, and it is a smooth function of the delay, as a fit needs it. Before the run the first
sample holds.
"""

import numpy as np
from numpy.typing import NDArray


def totals(samples: NDArray) -> NDArray:
    """Integrals of held samples (samples, inputs) [sampling periods], (samples + 1, inputs)."""
    return np.concatenate([np.zeros((1, *samples.shape[1:])), np.cumsum(samples, axis=0)])


def delayed_mean(total: NDArray, since: float, length: float) -> float:
    """Mean of a held input over a stretch; numba compiles this function.

    total: integral of the input, (samples + 1,). since, length: of the stretch [sampling periods].
    """
    ends = (since, since + length)
    values = [0.0, 0.0]
    for i in range(2):
        k = min(max(int(np.floor(ends[i])), 0), len(total) - 2)
        values[i] = total[k] + (ends[i] - k) * (total[k + 1] - total[k])
    return (values[1] - values[0]) / length


def delayed_means(total: NDArray, since: NDArray, length: float) -> NDArray:
    """The same for n inputs at once, (n,); total: (samples + 1, n). since: (n,)."""
    lanes = np.arange(total.shape[1])
    values = []
    for end in (since, since + length):
        k = np.clip(np.floor(end).astype(int), 0, len(total) - 2)
        values.append(total[k, lanes] + (end - k) * (total[k + 1, lanes] - total[k, lanes]))
    return (values[1] - values[0]) / length
