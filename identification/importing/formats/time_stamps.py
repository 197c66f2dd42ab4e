"""Points in time as seconds."""

import numpy as np
from numpy.typing import NDArray


def seconds(values: NDArray) -> NDArray:
    """Numbers as they are; points in time (datetime64) as seconds from the first, (samples,)."""
    if values.dtype.kind != "M":
        return np.asarray(values, dtype=float)
    return (values - values[:1]) / np.timedelta64(1, "s") if len(values) else np.empty(0)
