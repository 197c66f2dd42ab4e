"""Fully connected layers whose sums run in one order: a state's logits do not depend on its batch.

The products of a linear algebra library are summed in blocks that depend on the number of rows; then
the same episode could end otherwise in a larger batch, or on another machine.
"""

import numba
import numpy as np
from numpy.typing import NDArray


@numba.njit(cache=True, nogil=True)
def _sums(signal: NDArray, weight: NDArray, bias: NDArray) -> NDArray:
    inputs, outputs = weight.shape
    out = np.empty((len(signal), outputs), signal.dtype)
    for row in range(len(signal)):
        for j in range(outputs):
            out[row, j] = bias[j]
        for i in range(inputs % 4):  # outputs side by side: that is what a CPU can vectorise
            for j in range(outputs):
                out[row, j] += signal[row, i] * weight[i, j]
        for i in range(inputs % 4, inputs, 4):  # and the row of them is fetched a quarter as often
            a, b, c, d = signal[row, i], signal[row, i + 1], signal[row, i + 2], signal[row, i + 3]
            for j in range(outputs):
                total = out[row, j] + a * weight[i, j]
                total = total + b * weight[i + 1, j]
                total = total + c * weight[i + 2, j]
                out[row, j] = total + d * weight[i + 3, j]
    return out


def dense(signal: NDArray, weight: NDArray, bias: NDArray) -> NDArray:
    """signal @ weight.T + bias: (n, inputs), (outputs, inputs), (outputs,) -> (n, outputs).

    All of one precision, and the sums too.
    """
    return _sums(np.ascontiguousarray(signal), np.ascontiguousarray(weight.T), bias)
