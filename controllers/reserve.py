"""Limits of raising p2: a slow valve needs a reserve above the target, an empty supply cannot raise p2.

Until a valve at rest opens, an application draws from the circuit unanswered. What it draws follows from
the plant alone, so a controller that knows its valve knows the reserve that it needs.
"""

import numpy as np
from numpy.typing import NDArray

from controllers.pulse_table import PulseTable
from epv_env.common.units import BAR, GRAM
from epv_env.plant.consumption import SCENARIOS
from epv_env.reward import BAND_BAR

HARDEST_FLOW = SCENARIOS["emergency"].flow[1] * GRAM
"""Flow of the hardest application that the reserve is for [kg/s]."""
MOST_RESERVE = 0.3
"""Largest reserve: above it a pulse's scatter would leave the band upwards [bar]."""
TOLERATED = BAND_BAR - 0.1
"""Expected breakdown that needs no reserve [bar]: what the band allows, less the scatter of p2 at rest.
The band is a constraint, so a reserve is kept by design; a search weighs what is left."""
LEAST_HEAD = 0.2
"""p1 - p2 below which the supply does not raise the circuit [bar]."""


def expected_breakdown(table: PulseTable, opens_from_rest: NDArray) -> NDArray:
    """What the hardest application draws from the circuit until the valve opens (n,) [bar].

    Args:
        table: of the valve, or of each.
        opens_from_rest: time until the piston lifts once the control chamber vents (n,) [s].
    """
    p = table.parameters
    fall = HARDEST_FLOW * p["R_gas"] * p["T_env"] / p["V2"] / BAR
    return fall * (table.release_lag + opens_from_rest)


def reserve_for(breakdown: NDArray, tolerated: float) -> NDArray:
    """How much higher p2 is held where this breakdown is expected (n,) [bar].

    tolerated: expected breakdown that needs no reserve [bar].
    """
    return np.clip(breakdown - tolerated, 0.0, MOST_RESERVE)


def reserve_of(table: PulseTable, opens_from_rest: NDArray, tolerated: float) -> NDArray:
    """`reserve_for` what is expected of a table's valve (n,) [bar]; opens_from_rest: (n,) [s]."""
    return reserve_for(expected_breakdown(table, opens_from_rest), tolerated)


def fed(p1: NDArray, p2: NDArray) -> NDArray:
    """Whether the supply can raise the circuit, bool (n,); p1, p2: [bar] (n,).

    A valve that stood open meanwhile would let p2 follow a refill of the supply far above the target:
    its control chamber would be empty, and take long to fill.
    """
    return p1 - p2 > LEAST_HEAD
