"""The delay between the voltage that is commanded and the voltage at the coil."""

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.equations import Inputs

U_ROW = Inputs._fields.index("U")
"""Row of the voltage in a table of inputs."""


def delayed_inputs(table: NDArray, duration: NDArray, delay: NDArray) -> tuple[NDArray, NDArray]:
    """Inputs whose voltage acts later, and the durations for which they hold.

    Every period is split in two: the first part still has the former voltage. The first voltage is
    taken to have acted before.

    Args:
        table: inputs (periods, rows of Inputs, lanes) [SI].
        duration: (periods, lanes) [s]; the same in all periods of a lane, or 0.
        delay: (lanes,) [s].

    Returns:
        Both with twice the periods; every second one ends where a period of the original ends.
    """
    longest = np.max(duration, axis=0)
    whole = np.floor(delay / np.where(longest > 0, longest, np.inf) + 1e-9).astype(int)
    rest = np.maximum(delay - whole * longest, 0.0)
    U = table[:, U_ROW]
    at = np.arange(len(U))[:, None] - whole
    parts = np.repeat(table, 2, axis=0)
    parts[0::2, U_ROW] = np.take_along_axis(U, np.maximum(at - 1, 0), axis=0)
    parts[1::2, U_ROW] = np.take_along_axis(U, np.maximum(at, 0), axis=0)
    before = np.minimum(rest, duration)
    durations = np.empty((2 * len(U), U.shape[1]))
    durations[0::2], durations[1::2] = before, duration - before
    return parts, durations
