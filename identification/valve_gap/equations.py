"""The valve's state equations f1 to f7 (report eqs 5 to 12), forcings on them, and its regimes."""

from collections.abc import Callable, Mapping

import numba
import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import BAR, GRAM, MILLIGRAM, MILLIMETRE
from epv_env.plant.channels import readings
from epv_env.plant.coefficients import coefficients
from epv_env.plant.effects.registry import effect_constants
from epv_env.plant.equations import Inputs, State, derivative
from epv_env.plant.lanes import coefficients_at, effects_at, inputs_at, state_at, store_state
from epv_env.plant.primitives import FLAGS, source_digest
from epv_env.plant.simulate import Trajectory, energised, simulate
from epv_env.plant.valves import Valves
from identification.gap.plant import Contribution, StateEquation, StateTrace
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

OF_EFFECTS = State._fields[State._fields.index("I_coil") + 1 :]
"""States that effects add; they rest at 0 without them."""

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


def contribution(
    drive: ModelInputs, p: Mapping[str, float], without: Mapping[str, float]
) -> Contribution:
    """Forcings and readings that the model with the parameters `p` has beyond that with `without`.

    Both along the course of the model with p; parameters by symbol [SI].
    """
    answer = modelled(drive, p)
    course = np.array([np.broadcast_to(field, answer.time.shape) for field in answer.state])
    bare = course.copy()
    bare[State._fields.index(OF_EFFECTS[0]) :] = 0.0
    inputs = np.zeros((len(Inputs._fields), len(drive.U)))
    inputs[Inputs._fields.index("U")] = drive.U
    inputs[Inputs._fields.index("sigma_S")] = drive.sigma_S
    valve = coefficients(without), effect_constants(without)
    nominal = _rates(bare, inputs, *valve)
    added = _rates(course, inputs, coefficients(p), effect_constants(p)) - nominal
    equations = {}
    for equation, (name, state, sign) in FORCINGS.items():
        row, pushed = State._fields.index(state), inputs.copy()
        pushed[Inputs._fields.index(name)] += sign * _STEPS[equation]
        gain = (_rates(bare, pushed, *valve) - nominal)[row] / _STEPS[equation]
        # Where a diode holds the voltage of the coil, none acts from outside.
        equations[equation] = np.divide(added[row], gain, out=np.zeros_like(gain), where=gain != 0.0)
    with_p, bared = readings(answer.state, p), readings(answer.state, {**p, **without})
    return Contribution(
        equations=equations,
        readings=np.stack([(with_p[o] - bared[o]) + np.zeros(len(drive.U)) for o in OUTPUTS]),
    )


_STEPS = {equation.name: equation.step for equation in EQUATIONS}


def _compiled_rates(digest: str) -> Callable[..., None]:
    @numba.njit(cache=True, **FLAGS)
    def rates_along(states, inputs, c, e, out):
        if digest == "":
            return
        valve, effects = coefficients_at(c, 0, 0), effects_at(e, 0, 0)
        for k in range(states.shape[1]):
            q, u = state_at(states, 0, k), inputs_at(inputs, 0, k)
            store_state(out, 0, k, derivative(q, u, valve, effects, 1.0, 1.0, True)[0])

    return rates_along


_rates_along = _compiled_rates(source_digest())


def _rates(states: NDArray, inputs: NDArray, valve: NDArray, effects: NDArray) -> NDArray:
    """Rates of free movers at states (states, samples) under inputs (inputs, samples), likewise [SI].

    valve, effects: `coefficients` and `effect_constants` of one valve.
    """
    out = np.empty_like(states)
    _rates_along(states, inputs, valve, effects, out)
    return out


def _simulated(
    drive: ModelInputs, p: Mapping[str, float], m: int, inputs: Mapping[str, NDArray]
) -> NDArray:
    """OUTPUTS from the second sample on, (3, samples - 1, m)."""
    valves = Valves(m)
    valves.set_parameters(np.arange(m), p)
    initial = energised(p, p1=drive.p1_start, p2=drive.p2_start, U=drive.U_start)
    for field, value in zip(valves.state, initial, strict=True):
        field[:] = value
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


def _widened(mask: NDArray) -> NDArray:
    """The mask and one sample on either side: a flight may lie between two samples."""
    wide = mask.copy()
    wide[1:] |= mask[:-1]
    wide[:-1] |= mask[1:]
    return wide
