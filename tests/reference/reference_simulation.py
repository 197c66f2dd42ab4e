"""The plant's reference: SciPy's integrators in a hybrid automaton.

The reference shares the right-hand side and the definition of a rebound (STICK_SPEED) with
epv_env.plant.integrate, nothing else. The reference has its own modes (each mover free, held low or held
high), its own events, located by SciPy on the solver's dense output, and an adaptive method with error
control.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp

from epv_env.plant.equations import State
from tests.reference.hybrid_automaton import HybridAutomaton, RightHandSide, Schedule

RTOL = 1e-9
"""Relative tolerance of the solver."""

STATE_SCALES = State(
    p2=1e6, p3=1e6, xPV=1e-3, vPV=1.0, xMV=1e-3, vMV=1.0, I=1.0, p1=1e6,
    air_in_PV=1e-2, air_in_MV=1e-3, air_vented=1e-3, coil_energy=10.0, I_coil=1.0, coil_heat=10.0,
    heat_3=1.0, heat_2=1.0, far_pressure=1e6, supply_drop=1e6, lag_2=1e6, lag_3=1e6,
)  # fmt: skip
"""Usual size of each state; the absolute tolerance is rtol times this."""


@dataclass(frozen=True, kw_only=True)
class Event:
    """An instant at which the right-hand side changes its form."""

    time: float
    """[s]."""
    name: str
    """'piston lands low', 'armature leaves high', 'armature passes inlet kink' .."""


@dataclass(frozen=True, kw_only=True)
class ReferenceRun:
    """Result of the reference; the fields of `state` have the shape of `time`."""

    time: NDArray
    """Times of the samples, (samples,) [s]."""
    state: State
    """States at these times, each (samples,) [SI]."""
    events: list[Event]


def simulate_reference(
    schedule: Schedule,
    times: ArrayLike,
    *,
    method: str = "LSODA",
    rtol: float = RTOL,
    right_hand_side: RightHandSide | None = None,
    most_evaluations: float = np.inf,
) -> ReferenceRun:
    """Run a schedule through scipy.integrate.solve_ivp, piece by piece between events.

    times: sample times, (samples,) [s], rising. right_hand_side: another than the plant's compiled one.
    Raises RuntimeError where the solver fails, or needs more than `most_evaluations` of it.
    """
    times = np.asarray(times, dtype=float)
    automaton = HybridAutomaton(schedule, right_hand_side, most_evaluations)
    y = np.array(schedule.initial, dtype=float)
    out = np.full((len(times), len(y)), np.nan)
    out[times <= 0] = y
    log: list[Event] = []
    for segment, border in enumerate(schedule.borders[1:]):
        t = float(schedule.borders[segment])
        automaton.inputs[:] = [field[segment] for field in schedule.inputs]
        automaton.update_modes(y)
        while t < border:
            piece = _piece(automaton, t, float(border), y, method, rtol)
            inside = (times > t) & (times <= piece.t[-1])
            if np.any(inside):
                out[inside] = piece.sol(times[inside]).T
                automaton.read_current(out, np.flatnonzero(inside))
            if piece.t[-1] <= t and piece.status != 1:
                raise RuntimeError(f"reference is stuck at {t} s: {piece.message}")
            t, y = float(piece.t[-1]), piece.y[:, -1].copy()
            automaton.hold_at_stops(y)
            if piece.status == 1:
                for name, at in zip(piece.names, piece.t_events, strict=True):
                    if len(at):
                        log.append(Event(time=float(at[-1]), name=name))
                        automaton.apply_event(name, y)
                        if "lands" in name:
                            automaton.update_modes(y)
    return ReferenceRun(time=times, state=State(*out.T), events=log)


def _piece(automaton: HybridAutomaton, start: float, end: float, y: NDArray, method: str, rtol: float):
    """Integrate from `start` until `end` or the first event. Returns solve_ivp's result."""
    names, functions = [], []
    for name, function, direction in automaton.possible_events(y):
        function.terminal, function.direction = True, direction  # type: ignore[attr-defined]
        names.append(name)
        functions.append(function)
    result = solve_ivp(
        lambda t, y: automaton.rates_and_forces(y)[:-2],
        (start, end),
        y,
        method=method,
        rtol=rtol,
        atol=rtol * np.array(STATE_SCALES),
        events=functions,
        dense_output=True,
    )
    if result.status < 0:
        raise RuntimeError(f"reference failed at {result.t[-1]} s: {result.message}")
    result.names = names
    return result
