"""Opening pressure of the protection valve: the piston's balance at rest (report eq. 22)."""

from collections.abc import Mapping

from numpy.typing import NDArray

from epv_env.plant.primitives import QUARTER_PI


def opening_pressure(p: Mapping[str, float], p1: NDArray, p2: NDArray) -> NDArray:
    """Control pressure p3 below which the protection valve opens [Pa absolute], shape of p1.

    Args:
        p: parameters by symbol, numbers or (n,).
        p1: supply pressure (n,) [Pa absolute].
        p2: circuit pressure (n,) [Pa absolute].
    """
    piston, seat = QUARTER_PI * p["d1"] ** 2, QUARTER_PI * p["d2"] ** 2
    return p1 - ((p1 - p2) * seat + p["cPV"] * p["xPV0"]) / piston
