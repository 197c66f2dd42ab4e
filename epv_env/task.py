"""Limiting the circuit pressure: n episodes side by side. The environments are adapters to this.

An episode depends on its seed and its settings alone, not on its place in the batch: it draws from
generators of its own, one for the plant's parameters, one for pressures, target and consumption, one
for the noise, so that two plants compared under one seed meet the same disturbance and noise.
"""

from collections.abc import Sequence

import gymnasium
import numpy as np
from numpy.typing import NDArray

from epv_env.common.compilation import announce_compilation
from epv_env.episode import Start, under_conditions
from epv_env.observation import LAYOUT, LONGEST_WAIT
from epv_env.period import (
    EPISODE,
    NOISE_BLOCK,
    observe_first,
    rules_of,
    step_period,
)
from epv_env.plant.channels import MEASURED
from epv_env.plant.consumption import Profiles
from epv_env.plant.lanes import LANES, N_INPUT, N_STATE
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves, share
from epv_env.result import N_FIGURE, StepResult
from epv_env.settings import Settings
from epv_env.signals import PRESSURE_LIMITS_BAR, Followed, Signals, shared

PRESSURES = ("p1", "p2", "p3")
"""Pressures with which an episode begins."""


class LimitingTask:
    """n episodes of pressure limiting, advanced one control period at a time."""

    def __init__(self, n: int, settings: Settings, *, threads: int | None = None):
        """n: episodes. settings: of an episode begun without others. threads: None = all cores."""
        announce_compilation()
        self.n = n
        self.settings = settings
        self.period = settings.control_period
        self.valves = Valves(n, threads=threads)
        self.parameters: list[Parameters | None] = [None] * n
        self._begun = False
        self.parameter_values = np.zeros((n, len(Parameters.calibrated())))
        """The same as numbers, in the order of the parameter table (n, parameters) [SI]."""
        self.volumes = np.full(n, np.inf)
        """V1 of each episode's reservoirs (n,) [m^3]; infinite: the supply does not sag."""
        self.consumption = Profiles(n)
        """What is drawn from each circuit, the rest of the episode included."""
        self._episodes = np.zeros(n, dtype=EPISODE)
        self.signals: list[Followed] = [(None, None, None)] * n
        """Recorded supply, moving target and recorded consumption of each episode."""
        self._signals = Signals([], [], [])
        self.noise_of: list[np.random.Generator | None] = [None] * n
        self._noise = np.zeros((n, NOISE_BLOCK, len(MEASURED)))
        self._until_noise = NOISE_BLOCK
        tables = self.valves.tables
        lanes = tables.state.shape[1]
        self._inputs, self._duration = np.zeros((2, N_INPUT, lanes)), np.zeros((2, lanes))
        self._fixed = (
            self._episodes, self.consumption.progress, rules_of(settings), self._noise, *tables,
            np.zeros_like(tables.state), self._inputs, self._duration, np.empty((0, N_STATE, lanes)),
            self.valves.step,
        )  # fmt: skip

    @property
    def target(self) -> NDArray:
        """Target pressure (n,) [bar absolute]."""
        return self._episodes["target"]

    @property
    def steps(self) -> NDArray:
        """Control periods since each episode's start, (n,)."""
        return self._episodes["steps"]

    @property
    def coil(self) -> NDArray:
        """Whether it is on at the end of the last period, boolean (n,)."""
        return self._episodes["coil"]

    @property
    def memory(self) -> dict[str, NDArray]:
        """The arrays, by name, in which the episodes keep their past (see `Valves.memory`)."""
        return {
            "episodes": self._episodes, "progress": self.consumption.progress, "noise": self._noise,
            "parameter_values": self.parameter_values, "volumes": self.volumes, **self.valves.memory,
        }  # fmt: skip

    def settle(self) -> None:
        """Take note of what `memory` and `signals` hold now."""
        self._begun = None not in self.parameters
        self.valves.settle()
        self._find_signals()
        self._count_to_noise()

    def time(self) -> NDArray:
        """Time since each episode's start, (n,) [s]."""
        return self.steps * self.period

    def begin(
        self, where: NDArray, rngs: list[np.random.Generator], settings: list[Settings]
    ) -> NDArray:
        """Start new episodes at the indices `where`, one generator and one Settings for each.

        Returns all observations (n, entries); those of other episodes are as they were.
        """
        starts = [
            under_conditions(Start.draw(rng, chosen), chosen.conditions)
            for rng, chosen in zip(rngs, settings, strict=True)
        ]
        self._set_plants(where, starts)
        for i, start in zip(where.tolist(), starts, strict=True):
            self.parameters[i] = start.parameters
            self.consumption.start(i, start.consumption)
            recorded = None if start.supply.recording is None else start.supply
            self.signals[i] = (recorded, start.moving_target, start.recorded_consumption)
            self.noise_of[i] = start.noise
        e = self._episodes
        for name in ("target", "coil", "p3_frozen_at", "target_steps_at", "target_steps_to"):
            e[name][where] = [getattr(start, name) for start in starts]
        e["noise"][where] = [self.settings.sensor_noise * start.noise_factor for start in starts]
        for name in ("cut_in", "cut_out", "delivery", "idle_until"):
            e[name][where] = [getattr(start.supply, name) for start in starts]
        for name in ("steps", "violated", "compressor", "p1_slope"):
            e[name][where] = 0
        e["action"][where] = e["coil"][where]
        e["waited"][where] = LONGEST_WAIT
        self._begun = None not in self.parameters
        self._find_signals()
        self._draw_noise(where)
        self._count_to_noise()
        observation = np.empty((self.n, len(LAYOUT)), dtype=np.float32)
        tables = self.valves.tables
        observe_first(e, self._noise, tables.state, tables.sensors, where, observation)
        return observation

    def step(self, on_time: NDArray, action: NDArray) -> StepResult:
        """Energise each coil for the first `on_time` (n,) of the period [s], then switch it off.

        action: (n,) the fraction that was asked for, as the next observation shows it. Raises ValueError
        unless there is one of each for every episode, ResetNeeded unless all have begun.
        """
        if not self._begun:
            raise gymnasium.error.ResetNeeded("call reset() for every episode before step()")
        if not on_time.shape == action.shape == (self.n,):
            raise ValueError(f"got {len(on_time)} actions for {self.n} episodes: give one each")
        self._until_noise -= 1
        if self._until_noise == 0:
            self._draw_noise(np.flatnonzero((self.steps + 1) % NOISE_BLOCK == 0))
            self._count_to_noise(ahead=1)
        self._follow_signals()
        observation = np.empty((self.n, len(LAYOUT)), dtype=np.float32)
        figures = np.empty((N_FIGURE, self.n))
        arguments = (*self._fixed, on_time, action, figures, observation)
        lanes, threads = self._inputs.shape[2], self.valves.threads
        if self.valves.nominal:
            share(lambda *ends: step_period(*arguments, *ends, True, True), lanes, threads=threads)
        else:
            step_period(*arguments, 0, lanes, True, False)
            # the part of the period with the coil on, then the part with it off
            for inputs, duration in zip(self._inputs, self._duration[:, : self.n], strict=True):
                if np.any(duration):
                    for field, values in zip(self.valves.inputs, inputs, strict=True):
                        field[:] = values[: self.n]
                    self.valves.advance(duration)
            step_period(*arguments, 0, lanes, False, True)
        return StepResult(observation, figures)

    def _set_plants(self, where: NDArray, starts: Sequence[Start]) -> None:
        """Give the valves at `where` their parameters and their first state."""
        values = np.array([list(start.parameters.values()) for start in starts])
        self.parameter_values[where] = values
        p = dict(zip(starts[0].parameters, values.T, strict=True))
        self.volumes[where] = [start.supply.volume for start in starts]
        self.valves.set_parameters(where, p, self.volumes[where])
        p1, p2, p3 = (np.array([getattr(start, name) for start in starts]) for name in PRESSURES)
        coil = np.array([start.coil for start in starts])
        initial = energised(p, p1=p1, p2=p2, U=self.settings.supply_voltage * coil)
        initial = initial._replace(p3=p3, xMV=np.where(coil, initial.xMV, 0.0))
        for field, value in zip(self.valves.state, initial, strict=True):
            field[where] = value

    def _find_signals(self) -> None:
        """Note which episodes have a signal that has to be read in every period, and which."""
        self._signals = Signals(*map(shared, zip(*self.signals, strict=True)))

    def _follow_signals(self) -> None:
        """Set what recordings and moving targets say of the period that begins."""
        e = self._episodes
        for supply, who in self._signals.supplies:
            e["p1_slope"][who] = supply.slope(self.time()[who], self.period)
        for target, who in self._signals.targets:
            e["target"][who] = target.values(self.time()[who] + self.period, PRESSURE_LIMITS_BAR)
        for recorded, who in self._signals.consumptions:  # a leak that changes with every period
            leaks = recorded.mean_flow(self.time()[who], self.period)
            self.consumption.progress["leak"][who] = leaks

    def _draw_noise(self, where: NDArray) -> None:
        """Fill the blocks of noise of the episodes `where`."""

        def draw(first: int, last: int) -> None:
            for i in where[first:last].tolist():
                rng = self.noise_of[i]
                if rng is not None:
                    rng.standard_normal(out=self._noise[i])
                    self._noise[i] *= self._episodes["noise"][i]

        if self.settings.sensor_noise:
            share(draw, -(-len(where) // LANES) * LANES, threads=self.valves.threads)

    def _count_to_noise(self, ahead: int = 0) -> None:
        """Find the number of steps after which some episode has used up its block of noise.

        ahead: steps that are counted in `steps` only after the present one.
        """
        self._until_noise = int(np.min(NOISE_BLOCK - (self.steps + ahead) % NOISE_BLOCK))
