"""Limiting the circuit pressure: n episodes side by side. The environments are adapters to this.

An episode depends on its seed and its settings alone, not on its place in the batch: it draws from
generators of its own, one for the plant's parameters, one for pressures, target and consumption, one
for the noise, so that two plants compared under one seed meet the same disturbance and noise.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import BAR
from epv_env.observation import HISTORY, LONGEST_WAIT, P2_LAGS, P3_LAGS, encode
from epv_env.plant.channels import CHANNEL
from epv_env.plant.consumption import Profile, Profiles, draw_profile
from epv_env.plant.equations import State
from epv_env.plant.parameters import Parameters
from epv_env.plant.readings import MEASURED
from epv_env.plant.simulate import energised
from epv_env.plant.supply import Supply
from epv_env.plant.valves import Valves
from epv_env.reward import BAND_BAR, RewardTerms, reward_terms
from epv_env.settings import EMPTY_CIRCUIT_BAR, Settings

PRESSURES = ("p1", "p2", "p3")
"""Pressures with which an episode begins."""
NOISE_BLOCK = 256
"""Samples of noise drawn at a time for each episode."""


class StepResult(NamedTuple):
    """One control period of every episode; arrays of shape (n,) unless said otherwise."""

    observation: NDArray
    """(n, entries) float32."""
    reward: NDArray
    """Sum of the terms [-]."""
    terms: RewardTerms
    """Contribution of each weight [-]."""
    failed: NDArray
    """The circuit is empty, or the plant left what can be integrated: what ends an episode."""
    deviation_bar: NDArray
    """p2 - target of largest magnitude within the period."""
    switchings: NDArray
    """Switchings of the coil within the period."""
    vented_kg: NDArray
    """Air blown off within the period [kg]."""
    consumption: NDArray
    """Mean consumption of the period [kg/s]."""
    succeeded: NDArray
    """Settled and never outside the band since."""


@dataclass(frozen=True, kw_only=True)
class _Start:
    """Everything random about one episode but its noise."""

    parameters: Parameters
    p1: float
    p2: float
    p3: float
    target: float
    consumption: Profile
    noise: np.random.Generator
    supply: Supply

    @classmethod
    def draw(cls, rng: np.random.Generator, settings: Settings) -> "_Start":
        """Draw an episode; rng gives one seed, from which the three streams of the episode come."""
        seed = int(rng.integers(2**63))
        plant, disturbance, noise = (np.random.default_rng((seed, stream)) for stream in range(3))
        p1 = settings.supply.draw(disturbance)
        target = disturbance.uniform(*settings.target_bar)
        drop = disturbance.uniform(*settings.drop_bar)
        consumption = draw_profile(settings.scenario, disturbance)
        # Draws that only some settings need come last: they must not shift the others.
        p2 = target - drop if settings.p2_bar is None else disturbance.uniform(*settings.p2_bar)
        p3 = p1 if settings.p3_bar is None else disturbance.uniform(*settings.p3_bar) * BAR
        return cls(
            parameters=settings.region.draw(plant),
            p1=p1, p2=p2 * BAR, p3=p3, target=target,
            consumption=consumption,
            noise=noise,
            supply=settings.supply,
        )  # fmt: skip


class LimitingTask:
    """n episodes of pressure limiting, advanced one control period at a time."""

    def __init__(self, n: int, settings: Settings, *, threads: int | None = None):
        """n: episodes. settings: of an episode begun without others. threads: None = all cores."""
        self.n = n
        self.settings = settings
        self.period = settings.control_period
        self.valves = Valves(n, threads=threads)
        self.parameters: list[Parameters | None] = [None] * n
        self.target = np.zeros(n)
        """Target pressure [bar absolute]."""
        self.steps = np.zeros(n, dtype=np.int64)
        self.violated = np.zeros(n, dtype=bool)
        self.supplies = [settings.supply] * n
        self.consumption = Profiles(n)
        """What is drawn from each circuit, the rest of the episode included."""
        self.compressor = np.zeros(n, dtype=bool)
        """Whether it runs."""
        self.coil = np.ones(n, dtype=bool)
        """Whether it is on at the end of the last period."""
        self._special_supply = False
        self._action = np.ones(n)
        self._waited = np.zeros(n)
        self._noise: list[np.random.Generator | None] = [None] * n
        self._noise_block = np.zeros((n, NOISE_BLOCK, len(MEASURED)))
        self._p2_history = np.zeros((n, HISTORY))
        self._p3_history = np.zeros((n, HISTORY))
        self._reading = {name: np.zeros(n) for name in MEASURED}

    def time(self) -> NDArray:
        """Time since each episode's start, (n,) [s]."""
        return self.steps * self.period

    def begin(
        self, where: NDArray, rngs: list[np.random.Generator], settings: list[Settings]
    ) -> NDArray:
        """Start new episodes at the indices `where`, one generator and one Settings for each.

        Returns all observations (n, entries); those of other episodes are as they were.
        """
        where = np.asarray(where)
        starts = [_Start.draw(rng, chosen) for rng, chosen in zip(rngs, settings, strict=True)]
        p = {
            symbol: np.array([start.parameters[symbol] for start in starts])
            for symbol in starts[0].parameters
        }
        volumes = np.array([start.supply.volume for start in starts])
        self.valves.set_parameters(where, p, volumes)
        p1, p2, p3 = (np.array([getattr(start, name) for start in starts]) for name in PRESSURES)
        initial = energised(p, p1=p1, p2=p2, U=self.settings.supply_voltage)._replace(p3=p3)
        for field, value in zip(self.valves.state, initial, strict=True):
            field[where] = value
        for i, start in zip(where.tolist(), starts, strict=True):
            self.parameters[i] = start.parameters
            self.target[i] = start.target
            self.supplies[i] = start.supply
            self.consumption.start(i, start.consumption)
            self._noise[i] = start.noise
        self.steps[where] = 0
        self.violated[where] = False
        self.compressor[where] = False
        self.coil[where] = True
        self._action[where] = 1.0
        self._waited[where] = LONGEST_WAIT
        self._special_supply = any(s is not self.settings.supply for s in self.supplies)
        return self._observe(where, fresh=True)

    def step(self, on_time: NDArray, action: NDArray) -> StepResult:
        """Energise each coil for the first `on_time` (n,) of the period [s], then switch it off.

        action: (n,) the fraction that was asked for, as the next observation shows it.
        """
        switchings = self._switch(on_time, action)
        time = self.time()
        consumption = self.consumption.mean_flow(time, self.period)
        state = self.valves.state
        before = State(*(field.copy() for field in state))
        self._drive(on_time, time, consumption)
        lost = self._restore_lost(before)
        self.steps += 1

        error = state.p2 / BAR - self.target
        highest = self.valves.highest_p2 / BAR - self.target
        lowest = self.valves.lowest_p2 / BAR - self.target
        deviation = np.where(highest > -lowest, highest, lowest)
        failed = lost | (state.p2 <= EMPTY_CIRCUIT_BAR * BAR)
        settled = self.time() > self.settings.settling_time
        self.violated |= settled & (np.abs(deviation) > BAND_BAR)
        vented_kg = state.air_vented - before.air_vented
        terms = reward_terms(
            self.settings.weights,
            period=self.period,
            error_bar=error,
            highest_error_bar=highest,
            lowest_error_bar=lowest,
            switchings=switchings,
            vented_kg=vented_kg,
            failed=failed,
        )
        return StepResult(
            observation=self._observe(np.arange(self.n), fresh=False),
            reward=terms.total(),
            terms=terms,
            failed=failed,
            deviation_bar=deviation,
            switchings=switchings,
            vented_kg=vented_kg,
            consumption=consumption,
            succeeded=settled & ~self.violated & ~failed,
        )

    def _switch(self, on_time: NDArray, action: NDArray) -> NDArray:
        """Count the coil's switchings in this period and remember its last state."""
        begins_on = on_time > 0
        ends_on = on_time >= self.period
        switchings = (begins_on != self.coil).astype(np.int64) + (begins_on != ends_on)
        self.coil = ends_on
        self._action = action.astype(float)
        since = np.where(begins_on & ~ends_on, self.period - on_time, self.period)
        self._waited = np.where(switchings > 0, since, self._waited + self.period)
        return switchings

    def _drive(self, on_time: NDArray, time: NDArray, consumption: NDArray) -> None:
        """Advance the plant through the part with the coil on, then the part with it off."""
        inputs = self.valves.inputs
        inputs.sigma_S[:] = consumption
        self._supply_air(time)
        self.valves.forget_extremes()
        inputs.U[:] = np.where(on_time > 0, self.settings.supply_voltage, 0.0)
        whole = (on_time <= 0) | (on_time >= self.period)
        self.valves.advance(np.where(whole, self.period, on_time))
        if not np.all(whole):
            inputs.U[:] = 0.0
            self.valves.advance(np.where(whole, 0.0, self.period - on_time))

    def _restore_lost(self, before: State) -> NDArray:
        """Put valves that could not be integrated back where they were, and say which (n,).

        Their episodes fail; a learner must not meet a NaN.
        """
        lost = np.isnan(self.valves.state.p2)
        if np.any(lost):
            for field, earlier in zip(self.valves.state, before, strict=True):
                field[lost] = earlier[lost]
            self.valves.lowest_p2[lost] = self.valves.highest_p2[lost] = before.p2[lost]
        return lost

    def _supply_air(self, time: NDArray) -> None:
        """Set what the compressor delivers and what a recorded supply does."""
        inputs, p1 = self.valves.inputs, self.valves.state.p1
        if not self._special_supply:
            supply = self.settings.supply
            self.compressor = supply.compressor_runs(p1, self.compressor)
            inputs.refill[:] = supply.delivery * self.compressor
            inputs.p1_slope[:] = supply.slope(time, self.period)
            return
        for i, supply in enumerate(self.supplies):
            self.compressor[i] = supply.compressor_runs(p1[i], self.compressor[i])
            inputs.refill[i] = supply.delivery * self.compressor[i]
            inputs.p1_slope[i] = supply.slope(time[i : i + 1], self.period)[0]

    def _observe(self, where: NDArray, *, fresh: bool) -> NDArray:
        """Read the sensors of the episodes `where` and encode all observations.

        fresh: these episodes have just begun, so that their past is their present.
        """
        for name, values in self._read(where).items():
            self._reading[name][where] = values
        for history, name in ((self._p2_history, "p2"), (self._p3_history, "p3")):
            if fresh:
                history[where] = self._reading[name][where, None]
            else:
                history[:, 1:] = history[:, :-1].copy()
                history[:, 0] = self._reading[name]
        p2, p3 = self._p2_history, self._p3_history
        values = {
            "p2_error": p2[:, 0] - self.target,
            "target": self.target,
            "p1": self._reading["p1"],
            "p3": p3[:, 0],
            "I": self._reading["I"],
            "action": self._action,
            "since_switching": np.minimum(self._waited, LONGEST_WAIT),
        }
        values |= {f"p2_change_{lag}": p2[:, 0] - p2[:, lag] for lag in P2_LAGS}
        values |= {f"p3_change_{lag}": p3[:, 0] - p3[:, lag] for lag in P3_LAGS}
        return encode(values)

    def _read(self, where: NDArray) -> dict[str, NDArray]:
        """Sensor readings of the episodes `where` [bar, A]."""
        place = self.steps[where] % NOISE_BLOCK
        for i in where[place == 0]:
            rng = self._noise[i]
            if rng is not None and self.settings.sensor_noise:
                drawn = rng.standard_normal((NOISE_BLOCK, len(MEASURED)))
                self._noise_block[i] = self.settings.sensor_noise * drawn
        normal = self._noise_block[where, place]
        true = {name: value[where] for name, value in self.valves.readings().items()}
        return {
            name: CHANNEL[name].sensor.measure(true[name] / CHANNEL[name].scale, normal[:, k])
            for k, name in enumerate(MEASURED)
        }
