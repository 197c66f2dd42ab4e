"""What is not measured, from what is: strokes, speeds, consumption, by a model that follows the plant.

The calibrated plant runs along with the coil's voltage; each reading draws its pressures and current
towards what is measured, by the gain of a Kalman filter: a scalar one each for p1, p3 and I, one of two
states for p2 and the rate at which consumption lowers it. The model's change over a period is trusted
but for a share of itself; so a shut valve teaches the consumption, and an open one hardly does.
Consumption jumps, and a filter slow enough for the noise would lag: the cumulated innovation tells a
jump, and opens the filter again.

Sources: Simon, Optimal State Estimation (Wiley 2006), ch. 5 (Kalman filter); Gustafsson, Adaptive
Filtering and Change Detection (Wiley 2000), ch. 3 (cumulated sum) and 8 (covariance raised at a jump).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import BAR
from epv_env.observation import decode
from epv_env.plant.equations import State
from epv_env.plant.parameters import Parameters, table
from epv_env.plant.readings import MEASURED
from epv_env.plant.sensors import SENSORS, Sensor
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves

FLOORS = {"p1": 2e-3 * BAR, "p3": 5e-3 * BAR, "I": 2e-3}
"""Change within a period that no model foresees, standard deviation [Pa, A]."""

FLOOR_P2 = 0.5e-3 * BAR
"""The same for p2 beside its consumption [Pa]."""


def _variance(sensor: Sensor, unit: float) -> float:
    """Of a reading: noise and rounding [unit squared]."""
    return (sensor.noise**2 + sensor.resolution**2 / 12) * unit**2


VARIANCE = {name: _variance(SENSORS[name], 1.0 if name == "I" else BAR) for name in MEASURED}
"""Of each reading [Pa^2, A^2]."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """What is believed of n valves; SI units."""

    state: State
    """Fields (n,)."""
    consumption: NDArray
    """Air drawn from the circuit (n,) [kg/s]."""
    falling: NDArray
    """How fast that lowers p2 (n,) [Pa/s]."""
    parameters: dict[str, NDArray]
    """Values by symbol (n,): the given ones, with each coil's resistance as it was found."""

    def of(self, rows: NDArray) -> "Estimate":
        """The estimate of the valves at these indices alone."""
        return Estimate(
            state=State(*(field[rows] for field in self.state)),
            consumption=self.consumption[rows],
            falling=self.falling[rows],
            parameters={symbol: values[rows] for symbol, values in self.parameters.items()},
        )


@dataclass(kw_only=True)
class Estimator:
    """Follows n valves from their observations and the coil's states."""

    parameters: Parameters
    supply_voltage: float = 24.0
    """Of the coil when on [V]."""
    control_period: float = 5e-3
    model_error: float = 0.1
    """Share of a predicted change that may be wrong, standard deviation [1]."""
    drift: float = 1.5 * BAR
    """How fast the rate of consumption wanders: standard deviation after 1 s [Pa/s]."""
    jump: float = 3.0 * BAR
    """Standard deviation of a jump of that rate, given to the filter when one is noticed [Pa/s]."""
    alarm: float = 4.0
    """Cumulated normalised innovation at which a jump is noticed [1]."""
    slack: float = 0.5
    """Taken off the cumulated sum in every period [1]."""
    threads: int | None = None

    def reset(self, n: int) -> None:
        """Forget everything; n episodes begin."""
        self._valves = Valves(n, threads=self.threads)
        self._begun = False
        self._values = {symbol: np.full(n, value) for symbol, value in self.parameters.items()}
        self._rate = np.zeros(n)
        self._variance = {name: np.full(n, VARIANCE[name]) for name in MEASURED}
        self._rate_variance = np.full(n, self.jump**2)
        self._covariance = np.zeros(n)
        self._rising, self._falling = np.zeros(n), np.zeros(n)

    def observe(self, observations: NDArray, coil: NDArray) -> Estimate:
        """Take in observations (n, entries) made after a period with the coils on or off, bool (n,).

        The first observation of an episode only starts it, with the coil on as every episode begins. The
        estimate's arrays are the estimator's own: they hold until the next call.
        """
        read = {name: decode(observations, name).astype(float) for name in ("p2_error", "target", "I")}
        read |= {name: decode(observations, name).astype(float) * BAR for name in ("p1", "p3")}
        read["p2"] = (read.pop("p2_error") + read.pop("target")) * BAR
        if self._begun:
            self._predict(coil)
            self._correct(read)
        else:
            self._begin(read)
        return Estimate(
            state=self._valves.state, consumption=self._rate / self._pressure_per_mass(),
            falling=self._rate, parameters=self._values,
        )  # fmt: skip

    def _pressure_per_mass(self) -> NDArray:
        """How much p2 changes with the air in the circuit [Pa/kg]."""
        return self._values["R_gas"] * self._values["T_env"] / self._values["V2"]

    def _begin(self, read: dict[str, NDArray]) -> None:
        """Energised at rest, where the current tells the resistance (Ohm); p3 as it is read."""
        low, high = table()["R"].domain or (0.0, np.inf)
        self._values["R"] = np.clip(self.supply_voltage / np.maximum(read["I"], 1e-3), low, high)
        self._valves.set_parameters(np.arange(self._valves.n), self._values)
        initial = energised(self._values, p1=read["p1"], p2=read["p2"], U=self.supply_voltage)
        for field, value in zip(self._valves.state, initial._replace(p3=read["p3"]), strict=True):
            field[:] = value
        self._begun = True

    def _predict(self, coil: NDArray) -> None:
        """Run the model through a period and let the variances grow."""
        valves, T = self._valves, self.control_period
        before = State(*(field.copy() for field in valves.state))
        valves.inputs.U[:] = np.where(coil, self.supply_voltage, 0.0)
        valves.inputs.sigma_S[:] = self._rate / self._pressure_per_mass()
        valves.advance(T)
        for name, floor in FLOORS.items():
            change = getattr(valves.state, name) - getattr(before, name)
            self._variance[name] += (self.model_error * change) ** 2 + floor**2
        inflow = self._pressure_per_mass() * (valves.state.air_in_PV - before.air_in_PV)
        self._variance["p2"] += (
            T * (T * self._rate_variance - 2 * self._covariance)
            + (self.model_error * inflow) ** 2 + FLOOR_P2**2
        )  # fmt: skip
        self._covariance -= T * self._rate_variance
        self._rate_variance += self.drift**2 * T

    def _correct(self, read: dict[str, NDArray]) -> None:
        """Draw the model towards the readings."""
        for name in FLOORS:
            gain = self._variance[name] / (self._variance[name] + VARIANCE[name])
            field = getattr(self._valves.state, name)
            field += gain * (read[name] - field)
            self._variance[name] *= 1 - gain
        p2 = self._valves.state.p2
        innovation = read["p2"] - p2
        self._notice_jumps(innovation / np.sqrt(self._variance["p2"] + VARIANCE["p2"]))
        spread = self._variance["p2"] + VARIANCE["p2"]
        gain, rate_gain = self._variance["p2"] / spread, self._covariance / spread
        p2 += gain * innovation
        self._rate = np.maximum(self._rate + rate_gain * innovation, 0.0)
        self._rate_variance -= rate_gain * self._covariance
        self._covariance *= 1 - gain
        self._variance["p2"] *= 1 - gain

    def _notice_jumps(self, normalised: NDArray) -> None:
        """Two-sided cumulated sum of the normalised innovation; at an alarm the rate is open again."""
        self._rising = np.maximum(self._rising + normalised - self.slack, 0.0)
        self._falling = np.maximum(self._falling - normalised - self.slack, 0.0)
        alarm = np.maximum(self._rising, self._falling) > self.alarm
        self._rising[alarm] = self._falling[alarm] = 0.0
        raised = np.where(alarm, self.jump**2, 0.0)
        T = self.control_period
        self._rate_variance += raised
        self._covariance -= T * raised
        self._variance["p2"] += T**2 * raised
