"""One valve on a schedule as a hybrid automaton: the modes of its movers and the events."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from epv_env.plant.coefficients import coefficients
from epv_env.plant.effects.coil import OFF_VOLTAGE, coil_current
from epv_env.plant.effects.measurement import command_delays
from epv_env.plant.effects.registry import Effects, effect_constants, kernel_of, with_laws
from epv_env.plant.equations import Coefficients, Inputs, State, derivative
from epv_env.plant.lanes import coefficients_at, effects_at, inputs_at, state_at, store_state
from epv_env.plant.parameters import Parameters
from epv_env.plant.primitives import FLAGS, source_digest
from epv_env.plant.stepping import MOST_RESTITUTION, STICK_SPEED


@dataclass(frozen=True, kw_only=True)
class Schedule:
    """A valve, its state at time 0, and inputs that hold from one border to the next. SI units."""

    parameters: Parameters
    initial: State
    borders: NDArray
    """Times at which inputs change [s], from 0 to the end of the run, shape (segments + 1,)."""
    inputs: Inputs
    """One value per segment, shape (segments,)."""
    reservoir_volume: float = np.inf
    """Volume that feeds the input chamber [m^3]; infinite: p1 follows its inputs alone."""

    @property
    def duration(self) -> float:
        """Length of the run [s]."""
        return float(self.borders[-1])


def piecewise_schedule(
    parameters: Parameters,
    initial: State,
    borders: ArrayLike,
    *,
    U: ArrayLike,
    sigma_S: ArrayLike = 0.0,
    p1_slope: ArrayLike = 0.0,
    refill: ArrayLike = 0.0,
    reservoir_volume: float = np.inf,
) -> Schedule:
    """A Schedule; scalars hold throughout, and borders between equal inputs are dropped.

    Args:
        borders: times [s], (segments + 1,), from 0 to the end of the run.
        U: coil voltage [V], () or (segments,).
        sigma_S: air consumed from the circuit [kg/s], () or (segments,).
        p1_slope: rate of the supply pressure [Pa/s], () or (segments,).
        refill: air fed to the reservoir [kg/s], () or (segments,).
        reservoir_volume: [m^3].
    """
    times = np.asarray(borders, dtype=float)
    rows = np.stack(
        np.broadcast_arrays(*np.atleast_1d(U, sigma_S, p1_slope, refill), times[:-1])[:4]
    ).astype(float)
    changes = np.concatenate([[True], np.any(np.diff(rows, axis=1) != 0, axis=0)])
    return Schedule(
        parameters=parameters,
        initial=initial,
        borders=np.append(times[:-1][changes], times[-1]),
        inputs=Inputs(*rows[:, changes], *np.zeros((len(Inputs._fields) - 4, np.sum(changes)))),
        reservoir_volume=reservoir_volume,
    )


def delayed_schedule(schedule: Schedule, delays: NDArray) -> Schedule:
    """The schedule with every change of its inputs but the first later by its delay (segments - 1,) [s].

    A change that a later one overtakes, or that comes after the end, is lost. Only the voltage may
    change: inputs that act at once have no place in a delayed schedule.
    """
    later, end = schedule.borders[1:-1] + delays, schedule.duration
    before = np.minimum.accumulate(np.append(later, end)[::-1])[::-1]
    acts = later < before[1:]
    borders = np.concatenate([[0.0], later[acts], [end]])
    inputs = Inputs(*(field[np.append(True, acts)] for field in schedule.inputs))
    return replace(schedule, borders=borders, inputs=inputs)


def edge_delays(schedule: Schedule) -> NDArray:
    """The command delay of each change of a schedule's voltage, (segments - 1,) [s]."""
    return np.where(schedule.inputs.U[1:] > OFF_VOLTAGE, *command_delays(schedule.parameters))


RightHandSide = Callable[[NDArray, NDArray, NDArray, NDArray, float, float], NDArray]
"""(state, inputs, coefficients, effects, free_PV, free_MV) -> rates and both forces."""

TerminalCurrents = Callable[[float, NDArray, NDArray, NDArray], NDArray]
"""(voltage, states, coefficients, effects) -> currents."""


# Closed over by the compiled functions: a change of any inlined source changes their key in the cache.
_DIGEST = source_digest(Path(__file__))


def _terminal_currents(digest: str) -> TerminalCurrents:
    @numba.njit(cache=True, **FLAGS)
    def terminal_currents(U, states, coefficients, effects):
        out = np.empty(states.shape[1])
        if digest == "":  # keeps the digest in the closure
            return out
        c, e = coefficients_at(coefficients, 0, 0), effects_at(effects, 0, 0)
        for k in range(out.size):
            q = state_at(states, 0, k)
            out[k] = coil_current(U, q.I, c.R, q.coil_heat, with_laws(q, e, True))
        return out

    return terminal_currents


terminal_currents = _terminal_currents(_DIGEST)
"""Currents at the coil's terminals, (samples,) [A].

U: coil voltage [V]. states: (states, samples) [SI]. coefficients, effects: tables of one valve, as
epv_env.plant.coefficients makes them.
"""


def compiled_right_hand_side(extended: bool | None, digest: str = _DIGEST) -> RightHandSide:
    """`derivative` for one valve as a compiled function of arrays."""

    @numba.njit(cache=True, **FLAGS)
    def rates_and_forces(y, u, c, e, free_PV, free_MV):
        if digest == "":
            return np.zeros(0)
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


COMPILED_RIGHT_HAND_SIDES = {False: compiled_right_hand_side(None), True: compiled_right_hand_side(True)}
"""Compiled on first use."""


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


class HybridAutomaton:
    """One valve on a schedule: the modes of both movers and the events that change them."""

    def __init__(
        self, schedule: Schedule, right_hand_side: RightHandSide | None, most_evaluations: float
    ):
        c = coefficients(schedule.parameters, schedule.reservoir_volume)
        e = effect_constants(schedule.parameters)
        self.coefficients, self.effects = c, e
        self.right_hand_side = right_hand_side or COMPILED_RIGHT_HAND_SIDES[bool(np.any(kernel_of(e)))]
        self.inputs = np.zeros(len(Inputs._fields))
        named = Coefficients(*c[:, 0])
        self.stroke = (named.xPVmax, named.xMVmax)
        self.ePV = named.ePV
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
        acting = with_laws(State(*y), Effects(*self.effects[:, 0]), True)
        restitution = (self.ePV, min(acting.restitution_MV, MOST_RESTITUTION))[mover]
        rebound = -restitution * y[SPEEDS[mover]]
        y[POSITIONS[mover]] = stop
        y[SPEEDS[mover]] = rebound if abs(rebound) > STICK_SPEED else 0.0

    def read_current(self, out: NDArray, at: NDArray) -> None:
        """Fill in the current at the coil's terminals [A], which no equation of state holds.

        out: states (samples, states) [SI]; at: indices of samples.
        """
        states = np.ascontiguousarray(out[at].T)
        out[at, I_COIL] = terminal_currents(self.inputs[0], states, self.coefficients, self.effects)

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
