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
STATE_SCALES = State(
    p2=1e6, p3=1e6, xPV=1e-3, vPV=1.0, xMV=1e-3, vMV=1.0, I=1.0, p1=1e6,
    air_in_PV=1e-2, air_in_MV=1e-3, air_vented=1e-3, coil_energy=10.0, I_coil=1.0, coil_heat=10.0,
    heat_3=1.0, heat_2=1.0, far_pressure=1e6, supply_drop=1e6, lag_2=1e6, lag_3=1e6,
)  # fmt: skip
"""Usual size of each state; the absolute tolerance is rtol times this."""

OVERSHOOT = 1e-12
"""A stop counts as reached this far beyond it [m], so that leaving it is no landing on it."""

FREE, LOW, HIGH = 0, 1, 2
POSITIONS = (State._fields.index("xPV"), State._fields.index("xMV"))
SPEEDS = (State._fields.index("vPV"), State._fields.index("vMV"))
MOVERS = ("piston", "armature")
I_COIL = State._fields.index("I_coil")

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
    what: str
    """'piston lands low', 'armature leaves high', 'armature passes inlet kink' .."""


@dataclass(frozen=True, kw_only=True)
class ReferenceRun:
    """What the reference found; fields of `state` have the shape of `time`."""

    time: NDArray
    state: State
    events: list[Event]
    evaluations: int
    steps: int

    def away_from_events(self, margin: float, what: str = "") -> NDArray:
        """Which sample times lie farther than margin [s] from every event named with `what`."""
        at = np.array([event.time for event in self.events if what in event.what])
        return np.all(np.abs(self.time[:, None] - at) > margin, axis=1)


class HybridAutomaton:
    """One valve on a schedule: the modes of both movers and the events that change them."""

    def __init__(self, schedule: Schedule, right_hand_side: RightHandSide | None, most: float):
        c = coefficients(schedule.parameters, schedule.reservoir_volume)
        e = effect_sizes(schedule.parameters)
        self.c, self.e = c, e
        self.right_hand_side = right_hand_side or COMPILED_RIGHT_HAND_SIDES[bool(np.any(has_effects(e)))]
        self.u = np.zeros(len(Inputs._fields))
        named = Coefficients(*c[:, 0])
        self.stroke = (named.xPVmax, named.xMVmax)
        self.restitution = (named.ePV, named.eMV)
        self.kinks = {"inlet kink": named.kink_in, "exhaust kink": named.kink_exh}
        self.mode = [FREE, FREE]
        self.evaluations, self.most = 0, most

    def rates_and_forces(self, y: NDArray) -> NDArray:
        """Rates of the states in the present modes, then the forces on piston and armature [N]."""
        self.evaluations += 1
        if self.evaluations > self.most:
            raise RuntimeError(f"reference needs more than {self.most:g} evaluations")
        free = [1.0 if mode == FREE else 0.0 for mode in self.mode]
        y = np.ascontiguousarray(y)
        return self.right_hand_side(y, self.u, self.c, self.e, free[0], free[1])

    def settle_modes(self, y: NDArray) -> None:
        """Hold each mover that rests on a stop and is pressed against it."""
        forces = self.rates_and_forces(y)[-2:]
        for mover, (x, v) in enumerate(zip(y[list(POSITIONS)], y[list(SPEEDS)], strict=True)):
            low = v == 0 and x <= 0 and forces[mover] <= 0
            high = v == 0 and x >= self.stroke[mover] and forces[mover] >= 0
            self.mode[mover] = LOW if low else HIGH if high else FREE

    def pin(self, y: NDArray) -> None:
        """Undo what rounding in the solver did to the movers that are held."""
        for mover, mode in enumerate(self.mode):
            if mode != FREE:
                y[POSITIONS[mover]] = 0.0 if mode == LOW else self.stroke[mover]
                y[SPEEDS[mover]] = 0.0

    def land(self, y: NDArray, mover: int, stop: float) -> None:
        """Put a mover on the stop it has reached; it rebounds or stays."""
        rebound = -self.restitution[mover] * y[SPEEDS[mover]]
        y[POSITIONS[mover]] = stop
        y[SPEEDS[mover]] = rebound if abs(rebound) > STICK_SPEED else 0.0

    def read_current(self, out: NDArray, at: NDArray) -> None:
        """Fill in the current at the coil's terminals, which no equation of state holds."""
        q = State(*out[at].T)
        out[at, I_COIL] = _coil_currents(self.u[0], q.I, q.coil_heat, self.c, self.e)

    def events(self, y: NDArray) -> list[tuple[str, Callable, int]]:
        """(name, function of time and state whose zero ends the piece, direction) of each."""
        found = []
        for mover, name in enumerate(MOVERS):
            x, top = POSITIONS[mover], self.stroke[mover]
            if self.mode[mover] == FREE:
                found.append((f"{name} lands low", lambda t, y, x=x: y[x] + OVERSHOOT, -1))
                found.append((f"{name} lands high", lambda t, y, x=x, s=top: y[x] - s - OVERSHOOT, 1))
            else:
                at, way = ("low", 1) if self.mode[mover] == LOW else ("high", -1)
                force = -2 + mover
                found.append(
                    (f"{name} leaves {at}", lambda t, y, k=force: self.rates_and_forces(y)[k], way)
                )
        if self.mode[1] == FREE:
            for name, at in self.kinks.items():
                if abs(y[POSITIONS[1]] - at) > OVERSHOOT:
                    found.append(
                        (f"armature passes {name}", lambda t, y, at=at: y[POSITIONS[1]] - at, 0)
                    )
        return found

    def apply(self, what: str, y: NDArray) -> None:
        """What an event does to the state."""
        mover = MOVERS.index(what.split()[0])
        if what.endswith("lands low"):
            self.land(y, mover, 0.0)
        elif what.endswith("lands high"):
            self.land(y, mover, self.stroke[mover])
        elif "leaves" in what:
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

    times: sample times [s], rising. right_hand_side: another one than the plant's compiled one.
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
        automaton.u[:] = [field[segment] for field in schedule.inputs]
        automaton.settle_modes(y)
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
            automaton.pin(y)
            if piece.status == 1:
                for what, at in zip(piece.names, piece.t_events, strict=True):
                    if len(at):
                        log.append(Event(time=float(at[-1]), what=what))
                        automaton.apply(what, y)
                        if "lands" in what:
                            automaton.settle_modes(y)
    return ReferenceRun(
        time=times, state=State(*out.T), events=log, evaluations=automaton.evaluations, steps=steps
    )


def _piece(automaton: HybridAutomaton, start: float, end: float, y: NDArray, method: str, rtol: float):
    """Integrate from `start` until `end` or the first event. Returns solve_ivp's result."""
    names, functions = [], []
    for name, function, direction in automaton.events(y):
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
