"""How long a chamber takes to vent through an orifice, in units of its choked rate.

While the orifice is choked the pressure falls at a constant rate k = -d ln(p)/dt. Below the critical
ratio the flux falls, and with it the rate: -d ln(p)/dt = k flux(p) / choked flux(p) (report eq. 13, 14).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from epv_env.plant.primitives import CRITICAL_RATIO, bracket_over_drop

_LEAST, _MOST, _NODES = 1.002, 50.0, 2000
_RATIOS = np.geomspace(_LEAST, _MOST, _NODES)
"""Pressures over the ambient one [1]. Closer to it than sensors tell, nothing is left to vent."""


def relative_flux(ratio: NDArray) -> NDArray:
    """Flux over the choked flux of the same chamber (n,) [1].

    ratio: pressure over the one behind the orifice (n,) [1]; 1.002 at least counts.
    """
    choked = 1 - CRITICAL_RATIO
    drop = np.minimum(1 - 1 / np.maximum(ratio, _LEAST), choked)
    return np.sqrt(bracket_over_drop(drop) * drop / (bracket_over_drop(np.array(choked)) * choked))


_TIMES = cumulative_trapezoid(1 / relative_flux(_RATIOS), np.log(_RATIOS), initial=0.0)


def venting_time(ratio: NDArray) -> NDArray:
    """Time of venting from a pressure to the ambient one, times the choked rate k [1].

    ratio: pressure over the ambient one (n,) [1], absolute pressures; at most 50, and 1.002 at least
    counts.
    """
    return np.interp(ratio, _RATIOS, _TIMES)
