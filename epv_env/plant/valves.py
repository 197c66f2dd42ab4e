"""A batch of valves: the NumPy side of the compiled integrator, its threads and the coil's delay."""

import math
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from epv_env.common.units import BAR
from epv_env.plant import integrate
from epv_env.plant.channels import SENSOR_SYMBOLS
from epv_env.plant.coefficients import coefficients
from epv_env.plant.effects.coil import OFF_VOLTAGE
from epv_env.plant.effects.measurement import command_delays
from epv_env.plant.effects.registry import effect_constants, kernel_of
from epv_env.plant.equations import Inputs, State
from epv_env.plant.lanes import LANES, N_INPUT, N_STATE
from epv_env.plant.parameters import Parameters
from epv_env.plant.primitives import exact
from epv_env.plant.runge_kutta import DEFAULT_STEP


@cache
def _pool(process_id: int) -> ThreadPoolExecutor:
    """One pool per process: a forked child must not wait for its parent's threads."""
    return ThreadPoolExecutor(available_cores(), thread_name_prefix="epv-plant")


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def share(work: Callable[[int, int], None], lanes: int, *, threads: int, periods: int = 1) -> None:
    """Call work(first, last) for parts of the lanes, one part in each thread, this one included.

    Args:
        work: of lanes first..last, multiples of LANES.
        lanes: of the batch.
        threads: greatest number of parts.
        periods: that the work goes through; short work is not shared.
    """
    worth = lanes * periods // (4 * LANES)  # fewer lanes, times periods, cost less than a thread
    tasks = min(threads, lanes // LANES, worth)
    if tasks <= 1:
        work(0, lanes)
        return
    edges = [lanes // LANES * part // tasks * LANES for part in range(tasks + 1)]
    others = [_pool(os.getpid()).submit(work, *ends) for ends in pairwise(edges[1:])]
    try:
        work(edges[0], edges[1])
    finally:
        for other in others:
            other.result()


U_ROW = Inputs._fields.index("U")
"""Row of the voltage in a table of inputs."""


PARTS = 3
"""Of a period with a delayed voltage: delays to on and to off end within it, each at its own time."""


def delayed_inputs(table: NDArray, duration: NDArray, delays: NDArray) -> tuple[NDArray, NDArray]:
    """Inputs whose voltage acts later, and the durations for which they hold.

    The coil follows the latest voltage whose delay has passed: one that a later voltage overtakes never
    acts. Every period is split into PARTS. The first voltage is taken to have acted before.

    Args:
        table: inputs (periods, rows of Inputs, lanes) [SI].
        duration: (periods, lanes) [s]; the same in all periods of a lane, or 0.
        delays: of voltages that switch the coil on, and off, (2, lanes) [s].

    Returns:
        Both with PARTS times the periods; every PARTS-th one ends where a period of the original ends.
    """
    U, longest = table[:, U_ROW], np.max(duration, axis=0)
    whole = np.floor(delays / np.where(longest > 0, longest, np.inf) + 1e-9).astype(int)
    rest = np.maximum(delays - whole * longest, 0.0)
    number, on = np.arange(len(U))[:, None], U > OFF_VOLTAGE
    latest = [np.maximum.accumulate(np.where(own, number, 0), axis=0) for own in (on, ~on)]
    begins = np.zeros_like(duration)
    parts, durations = np.repeat(table, PARTS, axis=0), np.empty((PARTS * len(U), U.shape[1]))
    for part, end in enumerate((np.min(rest, axis=0), np.max(rest, axis=0), np.inf)):
        passed = [np.maximum(number - own - (begins < r), 0) for own, r in zip(whole, rest, strict=True)]
        arrived = [np.take_along_axis(*each, axis=0) for each in zip(latest, passed, strict=True)]
        parts[part::PARTS, U_ROW] = np.take_along_axis(U, np.maximum(*arrived), axis=0)
        ends = np.minimum(end, duration)
        durations[part::PARTS], begins = ends - begins, ends
    return parts, durations


@exact
def acting(commanded, duration, delay_on, delay_off, acted, left):
    """What a coil with delays sees of a voltage that is commanded for a duration [s].

    delay_on, delay_off: of a voltage that switches the coil on or off [s].
    acted: the voltage that acted last [V], NaN before the first. left: for how long it still acts [s].
    Returns for how long it acts now [s], and both as they are afterwards.
    """
    if duration <= 0.0:
        return 0.0, acted, left
    former = commanded if math.isnan(acted) else acted
    if former == commanded:
        return 0.0, commanded, 0.0
    if left <= 0.0:
        left = delay_on if commanded > OFF_VOLTAGE else delay_off
    before = min(left, duration)
    left -= before
    return before, (former if left > 0.0 else commanded), left


@numba.njit(cache=True)
def _act(commanded, duration, delay, acted, left, before):
    """`acting` of all lanes; acted and left (lanes,) change, before (lanes,) [s] is the result."""
    for i in range(len(commanded)):
        before[i], acted[i], left[i] = acting(
            commanded[i], duration[i], delay[0, i], delay[1, i], acted[i], left[i]
        )


SENSOR_RECORD = np.dtype((np.record, [(symbol, np.float64) for symbol in SENSOR_SYMBOLS]))
"""Parameters of one valve's sensors."""


class Tables(NamedTuple):
    """Arrays of a batch as the kernels (`integrate.run_nominal`) and the sensors take them."""

    state: NDArray
    """(N_STATE, lanes) [SI]."""
    coefficients: NDArray
    """(N_COEFFICIENT, lanes) [SI]."""
    effects: NDArray
    """(N_EFFECT, lanes) [SI]."""
    lowest: NDArray
    """Least p2 so far, (lanes,) [Pa]."""
    highest: NDArray
    """Greatest p2 so far, (lanes,) [Pa]."""
    sensors: NDArray
    """A record with SENSOR_SYMBOLS for each valve, (lanes,) [SI]."""


class Valves:
    """State and parameters of n valves, advanced together.

    Each valve's trajectory is the same to the bit whatever n, its place in the batch, and threads.
    """

    def __init__(self, n: int, *, step: float = DEFAULT_STEP, threads: int | None = None):
        """n: number of valves. step: largest integration step [s]. threads: None = all cores."""
        self.n = n
        self.step = step
        self.threads = available_cores() if threads is None else threads
        lanes = -(-n // LANES) * LANES
        calibrated = Parameters.calibrated()
        self.tables = Tables(
            state=np.zeros((N_STATE, lanes)),
            coefficients=np.repeat(coefficients(calibrated), lanes, axis=1),
            effects=np.repeat(effect_constants(calibrated), lanes, axis=1),
            lowest=np.full(lanes, np.inf),
            highest=np.full(lanes, -np.inf),
            sensors=np.zeros(lanes, dtype=SENSOR_RECORD),
        )
        """The arrays themselves, for compiled code that calls a kernel between work of its own."""
        self.tables.state[[State._fields.index(name) for name in ("p1", "p2", "p3")]] = BAR
        self._inputs = np.zeros((N_INPUT, lanes))
        self._duration = np.zeros(lanes)
        self._no_record = np.empty((0, N_STATE, lanes))
        self._kernel = np.zeros(lanes, dtype=int)
        self._delay = np.zeros((2, lanes))
        self._acting_U = np.full(lanes, np.nan)
        self._delay_left = np.zeros(lanes)
        self.nominal = True
        """Whether no valve has an effect or a delay: `integrate.run_nominal` is then all it takes."""

    @classmethod
    def started(
        cls, n: int, p: Mapping[str, ArrayLike], initial: State, *, reservoir_volume: ArrayLike = np.inf,
        step: float = DEFAULT_STEP, threads: int | None = None,
    ) -> "Valves":  # fmt: skip
        """n valves with these parameters (`set_parameters`), whose state is `initial`.

        initial: fields that broadcast to (n,) [SI].
        """
        valves = cls(n, step=step, threads=threads)
        valves.set_parameters(np.arange(n), p, reservoir_volume)
        for field, value in zip(valves.state, initial, strict=True):
            field[:] = value
        return valves

    @property
    def memory(self) -> dict[str, NDArray]:
        """The arrays, by name, in which a batch keeps all that its future depends on.

        Copy them, or fill them and call `settle`.
        """
        names = ("kernel", "delay", "acting_U", "delay_left")
        return {**self.tables._asdict(), **{name: getattr(self, f"_{name}") for name in names}}

    def settle(self) -> None:
        """Take note of what `memory` holds now."""
        self.nominal = not (np.any(self._kernel) or np.any(self._delay))

    @property
    def state(self) -> State:
        """Views of the state, one array of shape (n,) per field; writing to them sets the state."""
        return State(*self.tables.state[:, : self.n])

    @property
    def inputs(self) -> Inputs:
        """Views of the inputs that the next `advance` applies, shape (n,)."""
        return Inputs(*self._inputs[:, : self.n])

    def set_parameters(
        self, where: NDArray, p: Mapping[str, ArrayLike], reservoir_volume: ArrayLike = np.inf
    ) -> None:
        """Set the parameters of the valves at the indices `where`, (m,).

        p: values by symbol, scalars or arrays (m,) [SI]. reservoir_volume: V1, scalar or (m,) [m^3];
        infinite for a supply that does not sag.
        """
        self.tables.coefficients[:, where] = coefficients(p, reservoir_volume)
        constants = effect_constants(p)
        self.tables.effects[:, where] = constants
        self._kernel[where] = kernel_of(constants)
        self._delay[0, where], self._delay[1, where] = command_delays(p)
        self._acting_U[where] = np.nan
        for symbol in SENSOR_SYMBOLS:
            self.tables.sensors[symbol][where] = p[symbol]
        self.settle()

    def advance(self, duration: ArrayLike) -> None:
        """Apply `inputs` for `duration` [s], one for all or one per valve (n,).

        A coil with a delay keeps its former voltage for that long after a change of U; a change back
        within the delay cancels it.
        """
        self._duration[: self.n] = duration
        if not np.any(self._delay):
            self._run(self._inputs[None], self._duration[None], self._no_record)
            return
        # First under the former voltage as long as it still acts, then under the new one.
        commanded, total = Inputs(*self._inputs).U.copy(), self._duration.copy()
        former, before = self._acting_U.copy(), np.empty_like(total)
        _act(commanded, total, self._delay, self._acting_U, self._delay_left, before)
        for U, lasts in ((np.where(before > 0, former, commanded), before), (commanded, total - before)):
            Inputs(*self._inputs).U[:] = U
            self._run(self._inputs[None], lasts[None], self._no_record)

    def record(self, inputs: Inputs, period: ArrayLike) -> State:
        """Apply a series of inputs, each for `period` [s], and keep every state.

        inputs: fields that broadcast to (samples, n). period: a number, or one per sample and valve
        (samples, n); a valve stands still where it is 0. Returns fields of shape (samples, n): the state
        after each period. A valve that cannot be integrated becomes NaN.
        """
        samples = np.broadcast_shapes(*map(np.shape, inputs), (1, self.n))[0]
        table = np.zeros((samples, *self._inputs.shape))
        for row, field in enumerate(inputs):
            table[:, row, : self.n] = field
        duration = np.zeros((table.shape[0], table.shape[2]))
        duration[:, : self.n] = period
        delayed = bool(np.any(self._delay))
        if delayed:
            table, duration = delayed_inputs(table, duration, self._delay)
        out = np.empty((len(table), *self.tables.state.shape))
        self._run(table, duration, out)
        return State(*(out[PARTS - 1 :: PARTS] if delayed else out)[:, :, : self.n].transpose(1, 0, 2))

    def _run(self, inputs: NDArray, duration: NDArray, out: NDArray) -> None:
        """Run each kernel on the valves that need it.

        So a valve's trajectory does not depend, to the bit, on its companions' effects.
        """
        forced: Any = Inputs(*np.any(inputs, axis=0))
        kernel = np.maximum(self._kernel, forced.air_3 | forced.force_PV | forced.force_MV)
        needed = set(kernel[: self.n].tolist())
        if len(needed) == 1:
            self._run_with(integrate.KERNELS[needed.pop()], inputs, duration, out)
            return
        for number in needed:
            own, part = kernel == number, np.empty_like(out)
            self._run_with(integrate.KERNELS[number], inputs, np.where(own, duration, 0.0), part)
            out[:, :, own] = part[:, :, own]

    def _run_with(
        self, run: Callable[..., None], inputs: NDArray, duration: NDArray, out: NDArray
    ) -> None:
        """Run one kernel on all lanes, shared among threads."""
        t = self.tables

        def work(first: int, last: int) -> None:
            run(t.state, t.coefficients, t.effects, inputs, duration, t.lowest, t.highest, out,
                self.step, first, last)  # fmt: skip

        share(work, t.state.shape[1], threads=self.threads, periods=len(duration))
