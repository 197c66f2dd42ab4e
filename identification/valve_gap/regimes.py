"""In which regime the valve is at every sample, and what a missing term may depend on."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import BAR, MILLIMETRE
from epv_env.plant.simulate import Trajectory
from identification.gap.model.state_equation import StateTrace
from identification.valve_gap.settings import VALVE, ValveSettings


def regimes(
    answer: Trajectory,
    p: Mapping[str, float],
    energised: NDArray,
    settings: ValveSettings = VALVE,
) -> dict[str, NDArray]:
    """Boolean (samples,) by regime.

    Args:
        answer: the model's trajectory.
        p: parameters by symbol [SI].
        energised: whether the coil is on, boolean (samples,).
        settings: where a transient ends, and from when on something flows or moves.
    """
    q = answer.state
    current, greatest = np.abs(q.I), np.max(np.abs(q.I))
    settled = answer.U / p["R"]
    unseated = settings.unseated_stroke
    stroke_MV, open_PV = np.asarray(q.xMV) / p["xMVmax"], q.xPV > unseated * p["xPVmax"]
    rate = np.gradient(q.p3, answer.time)
    moving = {
        "coil_rise": energised & (settled - current > settings.settled_current * greatest),
        "armature_flight": _widened((stroke_MV > unseated) & (stroke_MV < 1 - unseated)),
        "coil_decay": ~energised & (current > settings.settled_current * greatest),
        "filling": rate > settings.flowing_rate,
        "venting": rate < -settings.flowing_rate,
        "pv_opening": open_PV & (q.vPV > settings.moving_speed),
        "pv_open": open_PV & (np.abs(q.vPV) <= settings.moving_speed),
        "pv_shutting": open_PV & (q.vPV < -settings.moving_speed),
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
