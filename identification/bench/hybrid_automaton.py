"""One valve as a hybrid automaton: the modes of its movers and the events that change them."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.coefficients import coefficients
from epv_env.plant.effects.registry import effect_constants, has_effects
from epv_env.plant.equations import Coefficients, Inputs, State
from epv_env.plant.stepping import STICK_SPEED
from identification.bench.right_hand_side import (
    COMPILED_RIGHT_HAND_SIDES,
    RightHandSide,
    terminal_currents,
)
from identification.bench.schedule import Schedule

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
        out[at, I_COIL] = terminal_currents(
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
