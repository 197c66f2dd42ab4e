"""Inputs between samples: held over each sampling period, and delayed where the plant reacts late."""

import numpy as np
from numpy.typing import NDArray


def totals(samples: NDArray) -> NDArray:
    """Integrals of held samples (samples, inputs) in sampling periods, (samples + 1, inputs)."""
    return np.concatenate([np.zeros((1, samples.shape[1])), np.cumsum(samples, axis=0)])


def delayed_mean(total: NDArray, since: float, length: float) -> float:
    """Mean of a held input over a stretch: the sample itself inside a period, and smooth in `since`.

    total: integral of the input, (samples + 1,). since, length: of the stretch [sampling periods]; a
    negative time has the first sample.
    """
    ends = (since, since + length)
    values = [0.0, 0.0]
    for i in range(2):
        k = min(max(int(np.floor(ends[i])), 0), len(total) - 2)
        values[i] = total[k] + (ends[i] - k) * (total[k + 1] - total[k])
    return (values[1] - values[0]) / length
