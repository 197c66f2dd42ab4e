"""The bench's simulator, and the plant's reference: SciPy's integrators in an automaton.

What it shares with epv_env.plant.integrate is the right-hand side and the definition of a rebound
(STICK_SPEED), nothing else: its own modes (each mover free, held low or held high), its own
events located by SciPy on the solver's dense output, an adaptive method with error control.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp

from epv_env.plant.coefficients import coefficients, effect_sizes, has_effects
from epv_env.plant.compiled import FLAGS
from epv_env.plant.effects import coil_current
from epv_env.plant.equations import Coefficients, Inputs, State, derivative
from epv_env.plant.integrate import STICK_SPEED
from epv_env.plant.lanes import coefficients_at, effects_at, inputs_at, state_at, store_state
from identification.bench.schedule import Schedule

RTOL = 1e-9
"""Relative tolerance of the solver."""

STATE_SCALES = State(
    p2=1e6, p3=1e6, xPV=1e-3, vPV=1.0, xMV=1e-3, vMV=1.0, I=1.0, p1=1e6,
    air_in_PV=1e-2, air_in_MV=1e-3, air_vented=1e-3, coil_energy=10.0, I_coil=1.0, coil_heat=10.0,
    heat_3=1.0, heat_2=1.0, far_pressure=1e6, supply_drop=1e6, lag_2=1e6, lag_3=1e6,
)  # fmt: skip
"""Usual size of each state; the absolute tolerance is rtol times this."""

OVERSHOOT = 1e-12
"""A stop counts as reached this far beyond it [m], so that leaving it is no landing on it."""

FREE, LOW, HIGH = 0, 1, 2
"""Modes of a mover: between the stops, held at the low stop, held at the high stop."""

POSITIONS = (State._fields.index("xPV"), State._fields.index("xMV"))
SPEEDS = (State._fields.index("vPV"), State._fields.index("vMV"))
"""Indices of the movers' positions and speeds in the state."""

MOVERS = ("piston", "armature")
"""Names of the movers in the events, in the order of `POSITIONS`."""

I_COIL = State._fields.index("I_coil")
"""Index of the current at the coil's terminals in the state."""

RightHandSide = Callable[[NDArray, NDArray, NDArray, NDArray, float, float], NDArray]
"""(state, inputs, coefficients, effects, free_PV, free_MV) -> rates and both forces."""


@numba.njit(**FLAGS)
def _coil_currents(U, current, coil_heat, coefficients, effects):
    """Currents at the coil's terminals [A] for states (samples,)."""
    c, e = coefficients_at(coefficients, 0, 0), effects_at(effects, 0, 0)
    out = np.empty_like(current)
    for k in range(current.size):
        out[k] = coil_current(U, current[k], c.R, coil_heat[k], e)
    return out


def compiled_right_hand_side(extended: bool) -> RightHandSide:
    """`derivative` for one valve as a compiled function of arrays."""

    @numba.njit(**FLAGS)
    def rates_and_forces(y, u, c, e, free_PV, free_MV):
        q = state_at(y.reshape(-1, 1), 0, 0)
        inputs = inputs_at(u.reshape(-1, 1), 0, 0)
        rates, force_PV, force_MV = derivative(
            q, inputs, coefficients_at(c, 0, 0), effects_at(e, 0, 0), free_PV, free_MV, extended
        )
        out = np.empty(y.size + 2)
        store_state(out.reshape(-1, 1), 0, 0, rates)
        out[-2], out[-1] = force_PV, force_MV
        return out

    return rates_and_forces


COMPILED_RIGHT_HAND_SIDES = {extended: compiled_right_hand_side(extended) for extended in (False, True)}
"""Compiled on first use."""


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
    evaluations: int
    """Of the right-hand side."""
    steps: int
    """Of the solver."""

    def away_from_events(self, margin: float, name_part: str = "") -> NDArray:
        """Whether each sample is farther than margin [s] from the named events, boolean (samples,)."""
        at = np.array([event.time for event in self.events if name_part in event.name])
        return np.all(np.abs(self.time[:, None] - at) > margin, axis=1)


class HybridAutomaton:
    """One valve on a schedule: the modes of both movers and the events that change them."""

    def __init__(
        self, schedule: Schedule, right_hand_side: RightHandSide | None, most_evaluations: float
    ):
        c = coefficients(schedule.parameters, schedule.reservoir_volume)
        e = effect_sizes(schedule.parameters)
        self.coefficients, self.effects = c, e
        self.right_hand_side = right_hand_side or COMPILED_RIGHT_HAND_SIDES[bool(np.any(has_effects(e)))]
        self.inputs = np.zeros(len(Inputs._fields))
        named = Coefficients(*c[:, 0])
        self.stroke = (named.xPVmax, named.xMVmax)
        self.restitution = (named.ePV, named.eMV)
        self.kinks = {"inlet kink": named.kink_in, "exhaust kink": named.kink_exh}
        self.mode = [FREE, FREE]
        self.evaluations, self.most_evaluations = 0, most_evaluations

    def rates_and_forces(self, y: NDArray) -> NDArray:
        """Rates of the states (states,) [SI/s] in the present modes, then the forces on both movers [N].

        Raises RuntimeError beyond the greatest number of evaluations. Returns (states + 2,).
        """
        self.evaluations += 1
        if self.evaluations > self.most_evaluations:
            raise RuntimeError(f"reference needs more than {self.most_evaluations:g} evaluations")
        free = [1.0 if mode == FREE else 0.0 for mode in self.mode]
        y = np.ascontiguousarray(y)
        return self.right_hand_side(y, self.inputs, self.coefficients, self.effects, free[0], free[1])

    def update_modes(self, y: NDArray) -> None:
        """Hold each mover that rests on a stop and is pressed against it; y: state (states,) [SI]."""
        forces = self.rates_and_forces(y)[-2:]
        for mover, (x, v) in enumerate(zip(y[list(POSITIONS)], y[list(SPEEDS)], strict=True)):
            low = v == 0 and x <= 0 and forces[mover] <= 0
            high = v == 0 and x >= self.stroke[mover] and forces[mover] >= 0
            self.mode[mover] = LOW if low else HIGH if high else FREE

    def hold_at_stops(self, y: NDArray) -> None:
        """Undo rounding in the positions and speeds of held movers; y: state (states,) [SI]."""
        for mover, mode in enumerate(self.mode):
            if mode != FREE:
                y[POSITIONS[mover]] = 0.0 if mode == LOW else self.stroke[mover]
                y[SPEEDS[mover]] = 0.0

    def apply_impact(self, y: NDArray, mover: int, stop: float) -> None:
        """Put a mover on the stop [m] that it has reached; the mover rebounds or stays.

        y: state (states,) [SI], changed in place.
        """
        rebound = -self.restitution[mover] * y[SPEEDS[mover]]
        y[POSITIONS[mover]] = stop
        y[SPEEDS[mover]] = rebound if abs(rebound) > STICK_SPEED else 0.0

    def read_current(self, out: NDArray, at: NDArray) -> None:
        """Fill in the current at the coil's terminals [A], which no equation of state holds.

        out: states (samples, states) [SI]; at: indices of samples.
        """
        q = State(*out[at].T)
        out[at, I_COIL] = _coil_currents(
            self.inputs[0], q.I, q.coil_heat, self.coefficients, self.effects
        )

    def possible_events(self, y: NDArray) -> list[tuple[str, Callable, int]]:
        """(name, function of time [s] and state whose zero ends the piece, direction) of each.

        y: state (states,) [SI].
        """
        events = []
        for mover, name in enumerate(MOVERS):
            x, top = POSITIONS[mover], self.stroke[mover]
            if self.mode[mover] == FREE:
                events.append((f"{name} lands low", lambda t, y, x=x: y[x] + OVERSHOOT, -1))
                events.append((f"{name} lands high", lambda t, y, x=x, s=top: y[x] - s - OVERSHOOT, 1))
            else:
                at, way = ("low", 1) if self.mode[mover] == LOW else ("high", -1)
                force = -2 + mover
                events.append(
                    (f"{name} leaves {at}", lambda t, y, k=force: self.rates_and_forces(y)[k], way)
                )
        if self.mode[1] == FREE:
            for name, at in self.kinks.items():
                if abs(y[POSITIONS[1]] - at) > OVERSHOOT:
                    events.append(
                        (f"armature passes {name}", lambda t, y, at=at: y[POSITIONS[1]] - at, 0)
                    )
        return events

    def apply_event(self, name: str, y: NDArray) -> None:
        """Change the state (states,) [SI] and the modes as an event does."""
        mover = MOVERS.index(name.split()[0])
        if name.endswith("lands low"):
            self.apply_impact(y, mover, 0.0)
        elif name.endswith("lands high"):
            self.apply_impact(y, mover, self.stroke[mover])
        elif "leaves" in name:
            self.mode[mover] = FREE


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
    steps = 0
    for segment, border in enumerate(schedule.borders[1:]):
        t = float(schedule.borders[segment])
        automaton.inputs[:] = [field[segment] for field in schedule.inputs]
        automaton.update_modes(y)
        while t < border:
            piece = _piece(automaton, t, float(border), y, method, rtol)
            steps += len(piece.t) - 1
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
    return ReferenceRun(
        time=times, state=State(*out.T), events=log, evaluations=automaton.evaluations, steps=steps
    )


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
