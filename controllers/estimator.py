"""State estimator: strokes, speeds and consumption from the readings, by Kalman filters on the model.

The calibrated plant model runs in parallel with the coil's voltage. Kalman filters correct its pressures
and its current by the readings: one scalar filter each for p1, p3 and I, and one with two states for p2
and the rate at which consumption lowers p2. The process noise grows with the model's own change in a
period, so the filter learns the consumption while the valve is shut, and hardly while it is open.
Consumption jumps, and a filter slow enough for the noise would lag. A cumulated sum of the innovation
detects a jump and raises the covariance again.

Sources: Simon, Optimal State Estimation (Wiley 2006), ch. 5 (Kalman filter); Gustafsson, Adaptive
Filtering and Change Detection (Wiley 2000), ch. 3 (cumulated sum) and 8 (covariance raised at a jump).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import BAR
from epv_env.observation import decode
from epv_env.plant.channels import MEASURED, SENSORS, Sensor
from epv_env.plant.equations import State
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves


@dataclass(frozen=True, kw_only=True)
class EstimatorSettings:
    """How far the filter trusts model and readings."""

    model_error: float = 0.3
    """Share of a predicted change that may be wrong, standard deviation [1]."""
    noise_p1: float = 2e-3 * BAR
    """Change of p1 in a period that the model does not foresee, standard deviation [Pa]."""
    noise_p2: float = 0.5e-3 * BAR
    """The same of p2, beside what is consumed [Pa]."""
    noise_p3: float = 5e-3 * BAR
    """The same of p3 [Pa]."""
    noise_I: float = 2e-3
    """The same of the coil's current [A]."""
    drift: float = 1.5 * BAR
    """Random walk of the rate at which consumption lowers p2: standard deviation after 1 s [Pa/s]."""
    jump: float = 3.0 * BAR
    """Standard deviation that the filter adds to this rate when it detects a jump [Pa/s]."""
    alarm: float = 4.0
    """Cumulated normalised innovation at which a jump is detected [1]."""
    slack: float = 0.5
    """Normalised innovation taken off the cumulated sum in every period [1]."""


SETTINGS = EstimatorSettings()


def _variance(sensor: Sensor, unit: float) -> float:
    """Variance of a sensor's reading in SI units. unit: of the sensor, in SI units."""
    return (sensor.noise**2 + sensor.resolution**2 / 12) * unit**2


READING_VARIANCE = {name: _variance(SENSORS[name], 1.0 if name == "I" else BAR) for name in MEASURED}
"""Of each reading: noise and rounding [Pa^2, A^2]."""

SCALAR_FILTERS = ("p1", "p3", "I")
"""Readings with a filter of their own; p2's has the rate of its fall as a second state."""


@dataclass(frozen=True, kw_only=True)
class StateEstimate:
    """The estimated state of n valves; SI units."""

    state: State
    """Fields (n,)."""
    consumption: NDArray
    """Air drawn from the circuit (n,) [kg/s]."""
    fall_rate: NDArray
    """Rate at which consumption lowers p2 (n,) [Pa/s]."""
    parameters: dict[str, NDArray]
    """Plant parameters by symbol (n,), with the estimated resistance of each coil."""

    def of(self, rows: NDArray) -> "StateEstimate":
        """The estimate of the valves at these indices alone."""
        return StateEstimate(
            state=State(*(field[rows] for field in self.state)),
            consumption=self.consumption[rows],
            fall_rate=self.fall_rate[rows],
            parameters={symbol: values[rows] for symbol, values in self.parameters.items()},
        )


@dataclass(kw_only=True)
class Estimator:
    """Follows n valves from their observations and the coil's states."""

    parameters: Parameters
    supply_voltage: float = 24.0
    """Of the coil when on [V]."""
    control_period: float = 5e-3
    settings: EstimatorSettings = SETTINGS
    threads: int | None = None

    def reset(self, n: int) -> None:
        """Forget everything; n episodes begin."""
        self._valves = Valves(n, threads=self.threads)
        self._begun = False
        self._values = {symbol: np.full(n, value) for symbol, value in self.parameters.items()}
        self._rate = np.zeros(n)
        self._variance = {name: np.full(n, READING_VARIANCE[name]) for name in MEASURED}
        self._rate_variance = np.full(n, self.settings.jump**2)
        self._covariance = np.zeros(n)
        self._rising, self._falling = np.zeros(n), np.zeros(n)

    def assume(self, parameters: Mapping[str, NDArray]) -> None:
        """Go on with other plant parameters: values (n,) by symbol."""
        self._values.update(parameters)
        if self._begun:
            self._valves.set_parameters(np.arange(self._valves.n), self._values)

    def observe(self, observations: NDArray, coil: NDArray) -> StateEstimate:
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
        return StateEstimate(
            state=self._valves.state, consumption=self._rate / self._pressure_per_mass(),
            fall_rate=self._rate, parameters=self._values,
        )  # fmt: skip

    def _pressure_per_mass(self) -> NDArray:
        """How much p2 changes with the air in the circuit [Pa/kg]."""
        return self._values["R_gas"] * self._values["T_env"] / self._values["V2"]

    def _begin(self, read: dict[str, NDArray]) -> None:
        """Energised at rest, where the current tells the resistance (Ohm); p3 as it is read."""
        low, high = self.parameters.domain("R")
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
        for name in SCALAR_FILTERS:
            change = getattr(valves.state, name) - getattr(before, name)
            noise = getattr(self.settings, f"noise_{name}")
            self._variance[name] += (self.settings.model_error * change) ** 2 + noise**2
        inflow = self._pressure_per_mass() * (valves.state.air_in_PV - before.air_in_PV)
        self._variance["p2"] += (
            T * (T * self._rate_variance - 2 * self._covariance)
            + (self.settings.model_error * inflow) ** 2 + self.settings.noise_p2**2
        )  # fmt: skip
        self._covariance -= T * self._rate_variance
        self._rate_variance += self.settings.drift**2 * T

    def _correct(self, read: dict[str, NDArray]) -> None:
        """Draw the model towards the readings."""
        for name in SCALAR_FILTERS:
            gain = self._variance[name] / (self._variance[name] + READING_VARIANCE[name])
            field = getattr(self._valves.state, name)
            field += gain * (read[name] - field)
            self._variance[name] *= 1 - gain
        p2 = self._valves.state.p2
        innovation = read["p2"] - p2
        self._detect_jumps(innovation / np.sqrt(self._variance["p2"] + READING_VARIANCE["p2"]))
        spread = self._variance["p2"] + READING_VARIANCE["p2"]
        gain, rate_gain = self._variance["p2"] / spread, self._covariance / spread
        p2 += gain * innovation
        self._rate = np.maximum(self._rate + rate_gain * innovation, 0.0)
        self._rate_variance -= rate_gain * self._covariance
        self._covariance *= 1 - gain
        self._variance["p2"] *= 1 - gain

    def _detect_jumps(self, normalised: NDArray) -> None:
        """Two-sided cumulated sum of the normalised innovation (n,); an alarm raises the covariance."""
        self._rising = np.maximum(self._rising + normalised - self.settings.slack, 0.0)
        self._falling = np.maximum(self._falling - normalised - self.settings.slack, 0.0)
        alarm = np.maximum(self._rising, self._falling) > self.settings.alarm
        self._rising[alarm] = self._falling[alarm] = 0.0
        raised = np.where(alarm, self.settings.jump**2, 0.0)
        T = self.control_period
        self._rate_variance += raised
        self._covariance -= T * raised
        self._variance["p2"] += T**2 * raised
