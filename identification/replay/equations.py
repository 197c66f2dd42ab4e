"""The valve's state equations f1 to f7 (report eqs 5 to 12), forcings on them, and its regimes."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import BAR, GRAM, MILLIGRAM, MILLIMETRE
from epv_env.plant.channels import readings
from epv_env.plant.effects.law import ARGUMENTS, arguments_of
from epv_env.plant.equations import Inputs
from epv_env.plant.simulate import Trajectory, energised, simulate
from epv_env.plant.valves import Valves
from identification.gap.plant import StateEquation, StateTrace
from identification.recordings.recording import OUTPUTS
from identification.replay.model_inputs import ModelInputs

EQUATIONS = (
    StateEquation(
        name="f1", meaning="air balance of the output chamber", state="p2", component="output_chamber",
        unit="g/s", scale=GRAM, step=1e-5,
    ),
    StateEquation(
        name="f2", meaning="air balance of the control chamber", state="p3", component="control_chamber",
        unit="mg/s", scale=MILLIGRAM, step=1e-6,
    ),
    StateEquation(
        name="f3", meaning="stroke of the piston", state="xPV", component="protection_valve",
        unit="m/s", step=0.0,
    ),
    StateEquation(
        name="f4", meaning="force balance of the piston", state="vPV", component="protection_valve",
        unit="N", step=0.1,
    ),
    StateEquation(
        name="f5", meaning="stroke of the armature", state="xMV", component="armature",
        unit="m/s", step=0.0,
    ),
    StateEquation(
        name="f6", meaning="force balance of the armature", state="vMV", component="armature",
        unit="N", step=1e-3,
    ),
    StateEquation(
        name="f7", meaning="voltage balance of the coil", state="I", component="solenoid",
        unit="V", step=1e-2,
    ),
)  # fmt: skip
"""f3 and f5 say x' = v: nothing can be missing there, and their step is 0."""

FORCINGS = {
    "f1": ("sigma_S", "p2", -1.0),
    "f2": ("air_3", "p3", 1.0),
    "f4": ("force_PV", "vPV", 1.0),
    "f6": ("force_MV", "vMV", 1.0),
    "f7": ("U", "I", 1.0),
}
"""Input of the simulator by which each equation is forced, the state whose rate it changes, and its
sign: drawn air lacks in p2."""

SETTLED_CURRENT = 0.02
"""Distance from the end value, relative to the greatest current, where a transient is over [-]."""

FLOWING_RATE = 1e6
"""Rate of p3 from which the control chamber fills or vents [Pa/s]."""

UNSEATED_STROKE = 1e-3
"""Share of its stroke beyond which a mover is off its seat [-]."""

MOVING_SPEED = 2e-3
"""Least speed of a piston that opens or shuts [m/s]."""


def modelled(drive: ModelInputs, p: Mapping[str, float]) -> Trajectory:
    """The model on a recording's inputs; p: every parameter by symbol [SI]."""
    drive = drive.without_sensor_errors(p)
    initial = energised(p, p1=drive.p1_start, p2=drive.p2_start, U=drive.U_start)
    return simulate(
        p, initial=initial, U=drive.U, period=drive.period, sigma_S=drive.sigma_S, p1=drive.p1
    )


def forced_changes(
    drive: ModelInputs, p: Mapping[str, float], forcing: Mapping[str, NDArray]
) -> NDArray:
    """`GreyBox.forced` on one recording: changes (3, samples, m) of OUTPUTS [Pa, Pa, A].

    p: every parameter by symbol [SI]. forcing: by equation, (samples, m) [kg/s, N, V].
    """
    drive = drive.without_sensor_errors(p)
    m = next(iter(forcing.values())).shape[1]
    base = {
        "U": drive.U[:-1, None],
        "sigma_S": drive.sigma_S[:-1, None],
        "p1_slope": np.diff(drive.p1)[:, None] / drive.period,
        "refill": np.zeros((1, 1)),
    }
    acting = dict(base)
    for equation, values in forcing.items():
        name, _, sign = FORCINGS[equation]
        none = np.zeros((len(values) - 1, 1))
        acting[name] = base.get(name, 0.0) + sign * np.hstack([none, values[:-1]])
    changes = np.zeros((len(OUTPUTS), len(drive.U), m))
    outputs = _simulated(drive, p, m + 1, acting)
    changes[:, 1:] = outputs[..., 1:] - outputs[..., :1]
    return changes


def _simulated(
    drive: ModelInputs, p: Mapping[str, float], m: int, inputs: Mapping[str, NDArray]
) -> NDArray:
    """OUTPUTS from the second sample on, (3, samples - 1, m)."""
    initial = energised(p, p1=drive.p1_start, p2=drive.p2_start, U=drive.U_start)
    valves = Valves.started(m, p, initial)
    read = readings(valves.record(Inputs(**inputs), drive.period), p)
    return np.stack([read[output] for output in OUTPUTS])


def regimes(
    answer: Trajectory,
    p: Mapping[str, float],
    energised: NDArray,
) -> dict[str, NDArray]:
    """Boolean (samples,) by regime.

    Args:
        answer: the model's trajectory.
        p: parameters by symbol [SI].
        energised: whether the coil is on, boolean (samples,).
    """
    q = answer.state
    current, greatest = np.abs(q.I), np.max(np.abs(q.I))
    settled = answer.U / p["R"]
    stroke_MV, open_PV = np.asarray(q.xMV) / p["xMVmax"], q.xPV > UNSEATED_STROKE * p["xPVmax"]
    rate = np.gradient(q.p3, answer.time)
    moving = {
        "coil_rise": energised & (settled - current > SETTLED_CURRENT * greatest),
        "armature_flight": _widened((stroke_MV > UNSEATED_STROKE) & (stroke_MV < 1 - UNSEATED_STROKE)),
        "coil_decay": ~energised & (current > SETTLED_CURRENT * greatest),
        "filling": rate > FLOWING_RATE,
        "venting": rate < -FLOWING_RATE,
        "pv_opening": open_PV & (q.vPV > MOVING_SPEED),
        "pv_open": open_PV & (np.abs(q.vPV) <= MOVING_SPEED),
        "pv_shutting": open_PV & (q.vPV < -MOVING_SPEED),
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


def law_traces(answer: Trajectory) -> dict[str, StateTrace]:
    """The states that the laws of effects may follow."""
    sizes = {"Pa": ("bar", BAR), "m": ("mm", MILLIMETRE)}
    traces = {}
    for name, values in arguments_of(answer.state).items():
        unit, scale = sizes.get(ARGUMENTS[name][0], (ARGUMENTS[name][0], 1.0))
        traces[name] = StateTrace(unit=unit, scale=scale, values=values)
    return traces


def _widened(mask: NDArray) -> NDArray:
    """The mask and one sample on either side: a flight may lie between two samples."""
    wide = mask.copy()
    wide[1:] |= mask[:-1]
    wide[:-1] |= mask[1:]
    return wide
