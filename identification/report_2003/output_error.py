"""The report's output error (eqs 19-21)."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import trapezoid


def relative_error(reference: NDArray, modified: NDArray, time: NDArray) -> NDArray:
    """Error of one output in one test, as a fraction (eq. 19).

    Root of the time mean of ((reference - modified) / mean of the reference)^2. reference: (samples,).
    modified: (samples,) or, for n variants, (samples, n). time: (samples,) [s]. Returns () or (n,).
    """
    duration = time[-1] - time[0]
    mean = trapezoid(reference, time) / duration
    deviation = (modified.T - reference) / mean
    return np.sqrt(trapezoid(deviation**2, time) / duration)


def partial_error(errors: Sequence[NDArray]) -> NDArray:
    """Error of one test, a fraction, from those of its outputs, each () or (n,) (eq. 20)."""
    return np.sqrt(sum(np.square(error) for error in errors))


def total_error(partial_errors: Sequence[NDArray]) -> NDArray:
    """Root mean square of the tests' partial errors, fractions () or (n,) each (eq. 21)."""
    return np.sqrt(np.mean(np.square(partial_errors), axis=0))
