"""Packing: the only place that knows in which row of a table a named quantity lies.

A table is an array [row, lane] whose columns are valves, so that a loop over lanes reads and writes
whole SIMD registers. The kernels work on one such table per block, the workspace, with these rows.
"""

import numba
import numpy as np

from epv_env.plant.effects.registry import Effects
from epv_env.plant.equations import Coefficients, Inputs, State
from epv_env.plant.primitives import FLAGS, generated, inlined

LANES = 16
"""Valves per block. LLVM vectorises a loop of this known length without run-time checks."""

N_STATE = len(State._fields)
"""Rows of a state."""
N_COEFFICIENT = len(Coefficients._fields)
"""Rows of the coefficients."""
N_EFFECT = len(Effects._fields)
"""Rows of the effects' constants."""
N_INPUT = len(Inputs._fields)
"""Rows of the inputs."""

STATE = 0
"""First row of the state; the next groups follow."""
TRIAL = STATE + N_STATE
"""First row of the state after the step on trial."""
COEFFICIENT = TRIAL + N_STATE
"""First row of the coefficients."""
EFFECT = COEFFICIENT + N_COEFFICIENT
"""First row of the effects' constants."""
INPUT = EFFECT + N_EFFECT
"""First row of the inputs."""
FORCE = INPUT + N_INPUT
"""Forces on the piston at the start, middle and end of the step, then on the armature [N]."""
N_FORCE = 6
"""Rows of the forces."""
REMAINING = FORCE + N_FORCE
"""Time left in the period [s]."""
TRIED = REMAINING + 1
"""Length of the step on trial [s]."""
HINT = TRIED + 1
"""Largest next step [s]."""
LOCATED = HINT + 1
"""How often the event that the next step ends at has been located; 0 where it ends at none."""
EVENT = LOCATED + 1
"""1 where the step on trial met an event, else 0."""
LOWEST = EVENT + 1
"""Least p2 so far [Pa]."""
HIGHEST = LOWEST + 1
"""Greatest p2 so far [Pa]."""
N_ROW = HIGHEST + 1
"""Rows of the workspace."""


@inlined
def new_workspace():
    """Working memory of one block. One array of literal shape: LLVM then sees that no rows overlap.

    Ones, for the lanes that never get a valve: their arithmetic must not slow down that of the others.
    """
    return np.ones((N_ROW, LANES))


def _reader(kind):
    """Function (table, first, lane) -> the `kind` that starts at row `first` of column `lane`."""
    items = ", ".join(f"table[first + {row}, lane]" for row in range(len(kind._fields)))
    return generated("read", "table, first, lane", f"return kind({items})", kind=kind)


def _per_field(expression: str) -> str:
    """The expression for each field of State, '@' standing for the field."""
    return ", ".join(expression.replace("@", field) for field in State._fields)


state_at = _reader(State)
"""The State (table, first row, lane)."""
coefficients_at = _reader(Coefficients)
"""The Coefficients (table, first row, lane)."""
effects_at = _reader(Effects)
"""The Effects (table, first row, lane)."""
inputs_at = _reader(Inputs)
"""The Inputs (table, first row, lane)."""


def _writer(fields):
    """Function (table, first, lane, q) that writes these fields of a State from row `first` on."""
    rows = ((State._fields.index(name), name) for name in fields)
    body = "; ".join(f"table[first + {row}, lane] = q.{name}" for row, name in rows)
    return generated("store", "table, first, lane, q", body)


store_state = _writer(State._fields)
"""Write a State from row `first` of column `lane` on."""

store_nominal = _writer(State._fields[: State._fields.index("I_coil") + 1])
"""The same without the states of effects, which rest in a nominal valve."""

chosen_state = generated(
    "chosen_state",
    "condition, q, other",
    f"return State({_per_field('q.@ if condition else other.@')})",
    State=State,
)
"""q where the condition holds, else other, without a branch."""

moved = generated(
    "moved", "q, rates, h", f"return State({_per_field('q.@ + h * rates.@')})", State=State
)
"""q + h * rates, field by field."""


# Compiled on its own: within its callers LLVM makes code of it that takes ten times as long.
@numba.njit(forceinline=True, **FLAGS)
def copy_column(source, source_row, source_lane, target, target_row, target_lane, n_rows):
    """Copy n_rows rows of one lane from table to table."""
    for row in range(n_rows):
        target[target_row + row, target_lane] = source[source_row + row, source_lane]
