"""A dense (fully connected) layer whose sums run in one order: its result does not depend on the batch.

The products of a linear algebra library are summed in blocks that depend on the number of rows. With
them the same episode could end differently in a larger batch, or on another machine.
"""

import numba
import numpy as np
from numpy.typing import NDArray


@numba.njit(cache=True, nogil=True)
def _sums(signal: NDArray, weight: NDArray, bias: NDArray) -> NDArray:
    """bias + signal @ weight, added in the order of the inputs; weight: (inputs, outputs)."""
    inputs, outputs = weight.shape
    out = np.empty((len(signal), outputs), signal.dtype)
    for row in range(len(signal)):
        for j in range(outputs):
            out[row, j] = bias[j]
        for i in range(inputs % 4):  # the inner loop runs over outputs: a CPU can vectorise it
            for j in range(outputs):
                out[row, j] += signal[row, i] * weight[i, j]
        for i in range(inputs % 4, inputs, 4):  # four inputs at a time: fewer reads of the output row
            a, b, c, d = signal[row, i], signal[row, i + 1], signal[row, i + 2], signal[row, i + 3]
            for j in range(outputs):
                total = out[row, j] + a * weight[i, j]
                total = total + b * weight[i + 1, j]
                total = total + c * weight[i + 2, j]
                out[row, j] = total + d * weight[i + 3, j]
    return out


def dense_layer(signal: NDArray, weight: NDArray, bias: NDArray) -> NDArray:
    """signal @ weight.T + bias.

    Args:
        signal: (n, inputs).
        weight: (outputs, inputs), of the signal's precision.
        bias: (outputs,), of the signal's precision.

    Returns:
        (n, outputs), of the same precision, in which the sums are also taken.
    """
    return _sums(np.ascontiguousarray(signal), np.ascontiguousarray(weight.T), bias)
