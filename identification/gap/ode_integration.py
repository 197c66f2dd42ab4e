"""Integration of plain differential equations for many candidates.

Inputs are held over each sampling period, and delayed where the plant reacts late: the mean of a delayed
input over a sub-step is taken from the input's integral. Without a delay it is the sample itself, and it
is a smooth function of the delay, as a fit needs it. Before the run the first sample holds.
"""

import keyword
import re
from collections import namedtuple
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
from numba.core.errors import NumbaError
from numba.extending import register_jitable
from numpy.typing import NDArray

from epv_env.common.law_form import KNOTS, MOST_LAWS

MOST_STEPS = 256
"""Most sub-steps in a sampling period that are tried; a model that needs more is stiff, and an explicit
method is the wrong one for it."""

TIME = "t"
"""Field of the inputs that holds the time since the start of the run [s]."""


def record(kind: str, names: Sequence[str]) -> Any:
    """A class of records with these fields. Raises ValueError for names that Python cannot have."""
    for name in names:
        if not name.isidentifier() or keyword.iskeyword(name) or name.startswith("_"):
            raise ValueError(
                f"{kind} '{name}': the name is used as in `p.{name}`, so it must be a Python name: "
                "rename it with letters, digits and _"
            )
    double = sorted({name for name in names if list(names).count(name) > 1})
    if double:
        raise ValueError(f"{kind} '{double[0]}' is given twice: give every {kind} a name of its own")
    return namedtuple(kind.replace(" ", "_"), names)


LAW_ROWS = 4 + KNOTS
"""Numbers of a law behind the symbols: place of its cause, of its argument, both ends, and the knots."""


class Records:
    """The records of one plant: states, inputs with the time, and parameters.

    Symbols of a cause follow its law: what they have beyond their nominal values is multiplied by 1 + g.
    """

    def __init__(
        self,
        states: Sequence[str],
        inputs: Sequence[str],
        symbols: Sequence[str],
        nominal: Sequence[float],
        owners: Sequence[int],
    ):
        """nominal, owners: value [SI] and number of the cause of each symbol, from 1 on; 0: none."""
        self.states, self.inputs, self.symbols = tuple(states), tuple(inputs), tuple(symbols)
        self.nominal = np.array(nominal, dtype=float)
        self.owners = np.array(owners, dtype=np.int64)
        self.x = record("state", self.states)
        self.u = record("input", (TIME, *self.inputs))
        self.p = record("parameter", self.symbols)

    def flat(self, function: Callable, count: int) -> Callable:
        """A function (x, t, u, p, out) of arrays that writes `count` results into `out`.

        The arrays' axes are states, inputs, symbols with the laws behind them, and results. The text is
        generated, as numba needs every field written out.
        """
        x = ", ".join(f"x[{i}]" for i in range(len(self.states)))
        u = ", ".join(["t", *(f"u[{i}]" for i in range(len(self.inputs)))])
        p = ", ".join(f"p[{i}]" for i in range(len(self.symbols)))
        lines = [
            "def flat(x, t, u, p, out):",
            "    p = lawful(x, u, p)",
            f"    r = function(State({x}), Input({u}), Parameter({p}))",
            *(f"    out[{i}] = r[{i}]" for i in range(count)),
            "    return out",
        ]
        names = {"function": function, "State": self.x, "Input": self.u, "Parameter": self.p}
        names["lawful"] = compiled(self._lawful())
        exec("\n".join(lines), names)
        return compiled(names["flat"])

    def _lawful(self) -> Callable:
        """A function (x, u, p) that gives the symbols as strong as their laws make them."""
        count, states, owners, nominal = len(self.symbols), len(self.states), self.owners, self.nominal

        def lawful(x, u, p):
            strong = p
            for law in range(MOST_LAWS):
                first = count + law * LAW_ROWS
                cause, argument = int(p[first]), int(p[first + 1])
                if cause == 0:
                    continue
                strong = strong.copy()
                a = x[argument - 1] if argument <= states else u[argument - 1 - states]
                at = (a - p[first + 2]) / (p[first + 3] - p[first + 2]) * (KNOTS - 1)
                at = min(max(at, 0.0), KNOTS - 1.0)
                knot = min(int(at), KNOTS - 2)
                g = p[first + 4 + knot]
                g += (at - knot) * (p[first + 5 + knot] - g)
                for i in range(count):
                    if owners[i] == cause:
                        strong[i] = nominal[i] + (strong[i] - nominal[i]) * max(1.0 + g, 0.0)
            return strong

        return lawful


_registered = register_jitable(error_model="numpy", no_cfunc_wrapper=True)


def compiled(function: Callable) -> Callable:
    """The function, which compiled ones may call, too; divisions by zero then give inf, as in numpy."""
    return function if hasattr(function, "py_func") else _registered(function)


@compiled
def delayed_mean(total: NDArray, since: float, length: float) -> float:
    """Mean of a held input over a stretch.

    total: integral of the input, (samples + 1,). since, length: of the stretch [sampling periods].
    """
    ends = (since, since + length)
    values = [0.0, 0.0]
    for i in range(2):
        k = min(max(int(np.floor(ends[i])), 0), len(total) - 2)
        values[i] = total[k] + (ends[i] - k) * (total[k + 1] - total[k])
    return (values[1] - values[0]) / length


def stepping(rate: Callable) -> Callable:
    """A function (x, t, h, u, p, push, work): a classical Runge-Kutta step of x (states,) by h [s].

    push: forcing of the rates, (states,). work: scratch, (5, states): four slopes and a stage.

    rate: derivatives of the states, as `Records.flat` makes it.
    """

    @compiled
    def slope(x, t, u, p, push, out):
        rate(x, t, u, p, out)
        for i in range(len(x)):
            out[i] += push[i]

    @compiled
    def step(x, t, h, u, p, push, work):
        slope(x, t, u, p, push, work[0])
        for stage in range(1, 4):
            part = h if stage == 3 else 0.5 * h
            for i in range(len(x)):
                work[4, i] = x[i] + part * work[stage - 1, i]
            slope(work[4], t + part, u, p, push, work[stage])
        for i in range(len(x)):
            inner = work[0, i] + 2.0 * work[1, i] + 2.0 * work[2, i] + work[3, i]
            x[i] += h / 6.0 * inner

    return step


Simulation = Callable[["Job"], tuple[NDArray, NDArray]]
"""Gives readings (channels, samples, n) and states (states, samples, n) [SI]; NaN from where a candidate
fails."""


@dataclass(frozen=True, kw_only=True)
class Job:
    """One run to be simulated for n candidates."""

    start: NDArray
    """States at the first sample, (states, n) [SI]."""
    inputs: NDArray
    """Samples of the inputs, held until the next one, (samples, inputs) [SI]."""
    delays: NDArray
    """By how much each input acts late, (inputs, n) [s]."""
    parameters: NDArray
    """Values of all symbols [SI], and the laws behind them, (symbols + laws, n)."""
    period: float
    """Sampling period [s]."""
    steps: int
    """Sub-steps in a sampling period."""
    push: NDArray
    """Forcing of the states' rates, held until the next sample, (samples, states, n) [SI/s]; (0, states,
    n) for none."""


def _reason(error: NumbaError) -> str:
    """The innermost of numba's nested reasons, without its colours."""
    lines = re.sub(r"\x1b\[\d*m", "", str(error)).splitlines()
    words = re.compile("No implementation|Untyped|Unsupported|Unknown|Use of|Cannot")
    return next((line.strip() for line in reversed(lines) if words.search(line)), lines[0])


def alone(step: Callable, read: Callable, channels: int, *, compile_it: bool) -> Simulation:
    """A simulation in which each candidate has a loop of its own.

    Args:
        step: of `stepping`.
        read: readings from states, as `Records.flat` makes it.
        channels: number of readings.
        compile_it: whether numba compiles the loop, with all that it calls.
    """

    @compiled
    def finite(x):
        total = 0.0
        for value in x:
            total += value
        return np.isfinite(total)

    def loop(x, inputs, total, delays, p, period, substeps, push, work, states, readings):
        u, none = np.empty(inputs.shape[1]), np.zeros(len(x))
        for k in range(len(inputs)):
            if not finite(x):
                break
            pushed = push[k] if k < len(push) else none
            for s in range(substeps):
                begin = k + s / substeps
                for i in range(len(u)):
                    if delays[i] == 0.0:
                        u[i] = inputs[k, i]
                    else:
                        u[i] = delayed_mean(total[:, i], begin - delays[i] / period, 1.0 / substeps)
                if s == 0:
                    for i in range(len(x)):  # numba compiles a slice with sentences for its errors
                        states[i, k] = x[i]
                    read(x, k * period, u, p, readings[:, k])
                step(x, begin * period, period / substeps, u, p, pushed, work)

    if compile_it:
        loop = numba.njit(error_model="numpy")(loop)

    def simulate(job: Job) -> tuple[NDArray, NDArray]:
        n, work = job.start.shape[1], np.empty((5, len(job.start)))
        states = np.full((n, len(job.start), len(job.inputs)), np.nan)
        readings = np.full((n, channels, len(job.inputs)), np.nan)
        # Integrals of the held inputs [sampling periods], (samples + 1, inputs).
        total = np.vstack([np.zeros((1, job.inputs.shape[1])), np.cumsum(job.inputs, axis=0)])
        starts, delays, parameters = (
            np.ascontiguousarray(own.T) for own in (job.start, job.delays, job.parameters)
        )
        pushes = np.ascontiguousarray(np.moveaxis(job.push, -1, 0))
        for c in range(n):
            given = starts[c], job.inputs, total, delays[c], parameters[c], job.period, job.steps
            try:
                loop(*given, pushes[c], work, states[c], readings[c])
            except ArithmeticError:
                continue  # functions such as math.exp refuse what numpy calls inf
            except NumbaError as error:
                raise ValueError(
                    f"rate or readings cannot be compiled by numba ({_reason(error)}): let them use "
                    "numbers, numpy and functions under numba.njit only, or choose mode='python'"
                ) from error
        return np.moveaxis(readings, 0, -1), np.moveaxis(states, 0, -1)

    return simulate


def simulator(records: Records, functions: Sequence[tuple[Callable, int]], mode: str) -> Simulation:
    """The simulation of a plant.

    Args:
        records: the plant's names.
        functions: rate and readings of records, each with its number of results.
        mode: "compiled" or "python".

    Raises:
        ValueError: for another mode, and at the first simulation for functions that numba refuses.
    """
    if mode not in ("compiled", "python"):
        raise ValueError(f"mode '{mode}' is none of compiled, python: choose one of them")
    used = compiled if mode == "compiled" else lambda function: function
    rate, read = (records.flat(used(f), results) for f, results in functions)
    return alone(stepping(rate), read, functions[1][1], compile_it=mode == "compiled")


def settled_steps(read: Callable[[int], Sequence[NDArray]]) -> int:
    """Sub-steps whose halving changes no reading noticeably, or the most that are tried.

    The first candidate must be finite; others may have values with which nothing can be simulated.

    read: readings with so many sub-steps, per run (channels, samples, n) [noise deviations].
    """
    steps, coarse = 1, read(1)
    while 2 * steps <= MOST_STEPS:
        fine = read(2 * steps)
        finite = all(np.all(np.isfinite(reading[..., 0])) for reading in fine)
        # Where only the fine one is finite, the change is infinite.
        changes = [
            np.where(np.isfinite(b), np.nan_to_num(np.abs(b - a), nan=np.inf), 0.0)
            for a, b in zip(coarse, fine, strict=True)
        ]
        # Noise deviations: far below what the readings can show.
        if finite and max(np.max(change) for change in changes) <= 0.05:
            return steps
        steps, coarse = 2 * steps, fine
    return steps
