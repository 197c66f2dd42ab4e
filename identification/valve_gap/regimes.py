"""In which regime the valve is at every sample, and what a missing term may depend on."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import BAR, MILLIMETRE
from epv_env.plant.simulate import Trajectory
from identification.gap.model.state_equation import StateTrace

SETTLED = 0.02
"""A current closer than this to its end value, relative to the greatest, is past its transient."""

PRESSURE_RATE = 1e6
"""The control chamber fills or vents where its pressure changes faster than this [Pa/s]."""

AJAR, MOVING = 1e-3, 2e-3
"""Stroke, relative to the whole, beyond which a mover is off its seat; least speed of a piston [m/s]."""


def regimes(answer: Trajectory, p: Mapping[str, float], energised: NDArray) -> dict[str, NDArray]:
    """Boolean (samples,) by regime.

    p: parameters by symbol [SI]. energised: whether the coil is on, boolean (samples,).
    """
    q = answer.state
    current, greatest = np.abs(q.I), np.max(np.abs(q.I))
    settled = answer.U / p["R"]
    stroke_MV, open_PV = np.asarray(q.xMV) / p["xMVmax"], q.xPV > AJAR * p["xPVmax"]
    rate = np.gradient(q.p3, answer.time)
    moving = {
        "coil_rise": energised & (settled - current > SETTLED * greatest),
        "armature_flight": _widened((stroke_MV > AJAR) & (stroke_MV < 1 - AJAR)),
        "coil_decay": ~energised & (current > SETTLED * greatest),
        "filling": rate > PRESSURE_RATE,
        "venting": rate < -PRESSURE_RATE,
        "pv_opening": open_PV & (q.vPV > MOVING),
        "pv_open": open_PV & (np.abs(q.vPV) <= MOVING),
        "pv_shutting": open_PV & (q.vPV < -MOVING),
    }
    return {**moving, "shut": ~np.any(list(moving.values()), axis=0)}


def traces(answer: Trajectory) -> dict[str, StateTrace]:
    """States and the pressure differences that drive flows and forces."""
    q = answer.state
    found = {
        "p1 - p2": ("bar", BAR, q.p1 - q.p2),
        "p1 - p3": ("bar", BAR, q.p1 - q.p3),
        "p2": ("bar", BAR, q.p2),
        "p3": ("bar", BAR, q.p3),
        "xPV": ("mm", MILLIMETRE, q.xPV),
        "vPV": ("m/s", 1.0, q.vPV),
        "xMV": ("mm", MILLIMETRE, q.xMV),
        "vMV": ("m/s", 1.0, q.vMV),
        "I": ("A", 1.0, q.I),
        "U": ("V", 1.0, answer.U),
    }
    return {
        name: StateTrace(unit=unit, scale=scale, values=np.asarray(values))
        for name, (unit, scale, values) in found.items()
    }


def _widened(mask: NDArray) -> NDArray:
    """The mask and one sample on either side: a flight may lie between two samples."""
    wide = mask.copy()
    wide[1:] |= mask[:-1]
    wide[:-1] |= mask[1:]
    return wide
