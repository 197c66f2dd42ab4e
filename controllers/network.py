"""The policy's network: a small multilayer perceptron, and the weight of the advice beside it."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from controllers.base import DIGEST, compiled


class Weights(NamedTuple):
    """A network as arrays, for compiled code."""

    widths: NDArray
    """Of the inputs and of each layer's outputs (layers + 1,)."""
    numbers: NDArray
    """Layer after layer: biases, then weights, input after input."""
    advice: NDArray
    """Weights of the advice in the two logits (2,)."""


@compiled
def tangent(x):
    """tanh(x) within 2.5e-7: Lambert's continued fraction, broken off after six terms, gives
    n/d = tanh(x/2), and tanh(x) = 2 (n/d) / (1 + (n/d)^2).

    No term is subtracted. Unlike the library's, many at once are computed in vectors.
    """
    if x > 9.02:
        return 1.0
    if x < -9.02:
        return -1.0
    s = 0.25 * x * x
    n = 0.5 * x * ((21.0 * s + 1260.0) * s + 10395.0)
    d = ((s + 210.0) * s + 4725.0) * s + 10395.0
    return 2.0 * n * d / (n * n + d * d)


@compiled
def forward(weights, inputs, signals):
    """Logits of coil off and on, into the first two of signals[0]; the advice is the last input.

    inputs (all,), signals (2, widest): of the precision of the weights, in which the sums are taken, in
    the order of the inputs.
    """
    widths, at, last = weights.widths, 0, len(weights.widths) - 2
    for layer in range(last + 1):
        source, out = signals[(last - layer + 1) % 2], signals[(last - layer) % 2]
        n, m = widths[layer], widths[layer + 1]
        for j in range(m):
            out[j] = weights.numbers[at + j]
        for i in range(n):
            at += m
            value = inputs[i] if layer == 0 else source[i]
            for j in range(m):  # over outputs, by indices never negative: both let it run in vectors
                out[j] += value * weights.numbers[np.uintp(at + j)]
        at += m
        if layer < last:
            for j in range(m):
                out[j] = tangent(out[j])
    for j in range(2):
        signals[0, j] += inputs[widths[0] - 1] * weights.advice[j]


def _loop(digest: str) -> Any:
    @numba.njit(cache=True, nogil=True, error_model="numpy")
    def forward_all(weights, inputs, signals, logits):
        if digest == "":
            return
        for i in range(len(inputs)):
            forward(weights, inputs[i], signals)
            logits[i] = signals[0, :2]

    return forward_all


_forward_all = _loop(DIGEST)


@dataclass(frozen=True, kw_only=True)
class Network:
    """A multilayer perceptron with tanh layers, and the weight of the advice beside it."""

    layers: list[tuple[NDArray, NDArray]]
    """Weight (outputs, inputs) and bias (outputs,) of each layer; the last gives two logits."""
    advice_weight: NDArray
    """Weights (2,) of the advice, the last of the inputs (-1: off, 1: on), in the logits."""

    def __repr__(self) -> str:
        return f"Network({' x '.join(map(str, self.weights.widths))}, {self.advice_weight.dtype})"

    @property
    def weights(self) -> Weights:
        """The network for compiled code."""
        widths = [self.layers[0][0].shape[1], *(len(bias) for _, bias in self.layers)]
        parts = [part for weight, bias in self.layers for part in (bias, weight.T.ravel())]
        return Weights(np.array(widths), np.concatenate(parts), self.advice_weight)

    @property
    def signals(self) -> NDArray:
        """Working memory of `forward`, (2, widest)."""
        return np.zeros((2, self.weights.widths[1:].max()), self.advice_weight.dtype)

    def logits(self, inputs: NDArray) -> NDArray:
        """Logits (n, 2) of coil off and coil on; inputs: readings and learnt quantities (n, all)."""
        logits = np.empty((len(inputs), 2), self.advice_weight.dtype)
        _forward_all(self.weights, inputs.astype(logits.dtype), self.signals, logits)
        return logits
