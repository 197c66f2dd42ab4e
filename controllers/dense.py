"""Fully connected layers whose sums run in one order: a state's logits do not depend on its batch.

The products of a linear algebra library are summed in blocks that depend on the number of rows; then
the same episode could end otherwise in a larger batch, or on another machine.
"""

import numba
import numpy as np
from numpy.typing import NDArray


@numba.njit(cache=True, nogil=True)
def _sums(signal: NDArray, weight: NDArray, bias: NDArray) -> NDArray:
    out = np.empty((signal.shape[0], weight.shape[1]), signal.dtype)
    for row in range(signal.shape[0]):
        for j in range(weight.shape[1]):
            out[row, j] = bias[j]
        for i in range(weight.shape[0]):  # outputs side by side: that is what a CPU can vectorise
            for j in range(weight.shape[1]):
                out[row, j] += signal[row, i] * weight[i, j]
    return out


def dense(signal: NDArray, weight: NDArray, bias: NDArray) -> NDArray:
    """signal @ weight.T + bias: (n, inputs), (outputs, inputs), (outputs,) -> (n, outputs).

    All of one precision, and the sums too.
    """
    return _sums(np.ascontiguousarray(signal), np.ascontiguousarray(weight.T), bias)
