"""The causal bound: what control can reach that knows plant and state, but not the future.

A rollout algorithm (Bertsekas, Reinforcement Learning and Optimal Control, Athena 2019, section 2.4):
every decision tries both actions on the simulation, lets a pulse controller with the plant's own table
go on from the true state, under several consumptions that may follow, and takes the action that costs
less on average. It is at least about as good as this pulse controller, and no proof of the best.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controllers.likely_consumption import likely_flows, scenario_of
from controllers.pulse import Pulse
from controllers.pulse_simulation import pulse_tables
from controllers.pulse_table import PulseTable
from epv_env.common.units import BAR
from epv_env.plant.consumption import Scenario
from epv_env.plant.equations import State
from epv_env.plant.valves import Valves
from epv_env.reward import EMPTY_CIRCUIT_BAR, reward_terms
from epv_env.task import LimitingTask


@dataclass(kw_only=True)
class CausalBound:
    """Acts on the true states of the episodes that it watches, whose scenarios it knows."""

    trigger: float = -0.06
    """Predicted p2 - target below which the pulse controller begins a pulse [bar]."""
    aim: float = 0.10
    """p2 - target at which its pulses shall end [bar]."""
    look_ahead: float = 1.0
    """Share of the time to open over which it extrapolates p2 [1]."""
    rounding: float = 0.7
    """Remaining time below which its pulses end now [control periods]."""
    draws: int = 8
    """Consumptions that a decision is tried on."""
    horizon: int = 80
    """Length of a trial [control periods]: a pulse from rest takes about 20."""
    threads: int | None = 1
    """Of the simulation; None: all cores."""
    seed: int = 0
    """Of the draws."""
    name: str = "causal bound"
    environment: str = "EPValve-v0"
    _task: LimitingTask | None = field(default=None, repr=False)

    def reset(self, n: int) -> None:
        """Nothing to forget: `watch` begins each batch anew."""

    def watch(self, task: LimitingTask) -> None:
        """See the episodes that have begun (controllers.base.Privileged).

        Raises ValueError for a consumption that is none of the named scenarios.
        """
        plants = [p for p in task.parameters if p is not None]
        self._task = task
        self._rng = np.random.default_rng(self.seed)
        self._scenarios: list[Scenario] = [scenario_of(record) for record in task.consumption.progress]
        self._owner = np.repeat(np.arange(task.n), 2 * self.draws)
        tables = pulse_tables(plants, task.settings.supply_voltage)
        self._pulse = Pulse(
            table=_own_tables(tables, self._owner), trigger=self.trigger, aim=self.aim,
            filter_time=task.period, look_ahead=self.look_ahead, rounding=self.rounding,
            control_period=task.period,
        )  # fmt: skip  # it filters nothing: it is told the true state
        p = {symbol: np.array([plant[symbol] for plant in plants]) for symbol in plants[0]}
        self._fall = (p["R_gas"] * p["T_env"] / p["V2"] / BAR)[self._owner]  # [bar/kg]
        self._valves = Valves(len(self._owner), threads=self.threads)
        volume = np.array([supply.volume for supply in task.supplies])
        each = {symbol: values[self._owner] for symbol, values in p.items()}
        self._valves.set_parameters(np.arange(self._valves.n), each, volume[self._owner])

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve, (n,). Raises ValueError if no task is watched."""
        task = self._task
        if task is None:
            raise ValueError("the causal bound sees no task: call watch(env.task) after the reset")
        costs = self._costs(task, self._flows(task)).reshape(task.n, 2, self.draws).mean(axis=2)
        return np.where(costs[:, 1] <= costs[:, 0], 1, 0)

    def _flows(self, task: LimitingTask) -> NDArray:
        """Mean flows that may follow, the same for both actions (trials, horizon) [kg/s]."""
        rows = [
            likely_flows(
                task.consumption.progress[i], scenario, time=float(task.time()[i]), period=task.period,
                periods=self.horizon, draws=self.draws, rng=self._rng,
            )
            for i, scenario in enumerate(self._scenarios)
        ]  # fmt: skip
        both = np.repeat(np.array(rows)[:, None], 2, axis=1)
        return both.reshape(-1, self.horizon)

    def _costs(self, task: LimitingTask, flows: NDArray) -> NDArray:
        """Price (trials,) of taking each action now and going on as the pulse controller does."""
        valves, owner = self._valves, self._owner
        for own, true in zip(valves.state, task.valves.state, strict=True):
            own[:] = true[owner]
        for name in ("acting_U", "delay_left"):  # of a coil that follows its command late
            valves.memory[name][: valves.n] = task.valves.memory[name][owner]
        target, coil = task.target[owner], task.coil[owner]
        delivery = np.array([supply.delivery for supply in task.supplies]) * task.compressor
        valves.inputs.refill[:] = delivery[owner]
        first = np.tile(np.repeat([False, True], self.draws), task.n)
        cost, vented = np.zeros(len(owner)), valves.state.air_vented.copy()
        for k in range(self.horizon):
            action = first if k == 0 else self._continued(valves.state, target, coil, flows[:, k - 1])
            valves.inputs.U[:] = np.where(action, task.settings.supply_voltage, 0.0)
            valves.inputs.sigma_S[:] = flows[:, k]
            valves.forget_extremes()
            valves.advance(task.period)
            error = valves.state.p2 / BAR - target
            terms = reward_terms(
                task.settings.weights, period=task.period, error_bar=error,
                highest_error_bar=valves.highest_p2 / BAR - target,
                lowest_error_bar=valves.lowest_p2 / BAR - target, switchings=action ^ coil,
                vented_kg=valves.state.air_vented - vented,
                failed=valves.state.p2 <= EMPTY_CIRCUIT_BAR * BAR,
            )  # fmt: skip
            cost -= terms.total()
            coil, vented = action, valves.state.air_vented.copy()
        return cost

    def _continued(self, state: State, target: NDArray, coil: NDArray, flow: NDArray) -> NDArray:
        """Whether the pulse controller energises the coils, bool (trials,); it sees state and flow."""
        p1, p2, p3 = state.p1 / BAR, state.p2 / BAR, state.p3 / BAR
        opens_in = self._pulse.table.time_to_open(p1, p2, p3)
        return self._pulse.decide((p1, p2, p3), opens_in, p2 - target, -self._fall * flow, coil)


@dataclass(frozen=True, kw_only=True)
class _TrialTables(PulseTable):
    """The tables of each trial's own valve, without a copy for each."""

    owner: NDArray
    """The valve, by its place in the tables (trials,)."""

    def _rows(self, table: NDArray, nodes: tuple[NDArray, ...]) -> NDArray:
        return table[self.owner, *nodes]


def _own_tables(tables: PulseTable, owner: NDArray) -> PulseTable:
    """The tables (n,) for trials that belong to the valves `owner` (trials,)."""
    return _TrialTables(
        parameters={s: np.asarray(v)[owner] for s, v in tables.parameters.items()},
        vent_rate=np.asarray(tables.vent_rate)[owner], release_lag=np.asarray(tables.release_lag)[owner],
        gain=tables.gain, lasts=tables.lasts, grid=tables.grid, owner=owner,
    )  # fmt: skip
