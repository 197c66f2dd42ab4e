"""The measured channels: one record each, from which sensors, readings and recordings are built.

A sensor turns a signal into what the bench's data acquisition gives: range, 12-bit resolution, noise.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import BAR
from epv_env.plant.equations import State
from epv_env.plant.parameters import ParameterError
from epv_env.plant.primitives import ROUNDING, Value


def digitised(value, standard_normal, low, noise, resolution, least, greatest):
    """Reading of a value with noise, in whole steps of the converter from `low` on, within its ends.

    Arguments are numbers or arrays that broadcast; the environment's step compiles this function.
    """
    steps = ((value - low + noise * standard_normal) / resolution + ROUNDING) - ROUNDING
    return np.minimum(np.maximum(low + steps * resolution, least), greatest)


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """The sensor of one channel, in the unit of the report's tables (bar absolute, A or V)."""

    low: float
    """Least value (Table 1)."""
    high: float
    """Greatest value (Table 1)."""
    accuracy: float
    """Accuracy as a fraction of the range's greatest value (Table 1); the ADC saturates beyond it."""
    noise: float
    """Standard deviation of the noise (Table 3)."""
    offset: float = 0.0
    """Reading less truth at the start of a recording (Table 2; pressures less 1 bar)."""
    trend: float = 0.0
    """Drift of the reading per second (Table 2)."""

    @property
    def resolution(self) -> float:
        """One step of the ADC [unit of the sensor]: 12 bit (section 3)."""
        return (self.high - self.low) / 2**12

    @property
    def margin(self) -> float:
        """Accuracy in the unit of the sensor."""
        return self.accuracy * self.high

    def measure(self, value: NDArray, standard_normal: NDArray) -> NDArray:
        """The readings for true values, any shape [unit of the sensor]; offset and trend not included.

        standard_normal: draws of the same shape [-]. A reading saturates where the range and its
        accuracy end.
        """
        return digitised(value, standard_normal, *self.constants())

    def constants(self) -> tuple[float, float, float, float, float]:
        """What `digitised` needs: least value, noise, resolution, least and greatest reading."""
        ends = self.low - self.margin, self.high + self.margin
        return self.low, self.noise, self.resolution, *ends


Reading = Callable[[State, Mapping[str, Value]], Value]
"""From the state and the sensors' parameters by symbol, of any shape, to the reading of that shape."""


class ChannelError(ValueError):
    """The record of a measured channel is incomplete or contradicts itself."""


@dataclass(frozen=True, kw_only=True)
class MeasuredChannel:
    """One measured signal of the bench."""

    name: str
    """Name in results, and of the field of `Recording`."""
    unit: str
    """Unit of tables, files, plots and of the sensor."""
    scale: float
    """Size of that unit [SI]."""
    sensor: Sensor
    """Range and accuracy (Table 1), noise (Table 3), offset and trend (Table 2) [unit]."""
    columns: tuple[str, ...]
    """Columns of a recording's file: the one that is written, then those that replace it together."""
    decimals: int
    """Decimals written to a file: a hundredth of a step of the ADC or less."""
    reading: Reading | None = None
    """What the sensor sees before noise and rounding [SI]; None: an input of the bench, fed back."""
    symbols: tuple[str, ...] = ()
    """Parameters that `reading` needs beyond the state."""
    observed: bool = False
    """Whether the controller of the environment reads the channel, too."""
    output: bool = False
    """Whether identification fits the channel (y of eq. 4)."""

    def __post_init__(self) -> None:
        fault = next(
            (f"{f} is empty: fill it in" for f in ("name", "unit", "columns") if not getattr(self, f)),
            None,
        )
        if self.scale <= 0.0:
            fault = f"scale is {self.scale:g}: give the size of one {self.unit} in SI units"
        if self.reading is None and (self.output or self.observed or self.symbols):
            fault = "an output or observed channel needs `reading`: give a function of the state"
        if fault:
            raise ChannelError(f"measured channel {self.name!r}: {fault}")


P1 = MeasuredChannel(
    name="p1",
    unit="bar",
    scale=BAR,
    sensor=Sensor(low=1.0, high=16.0, accuracy=0.016, noise=0.0068, offset=0.000909, trend=7.9e-5),
    columns=("p1_bar", "p1a_bar", "p1b_bar"),
    decimals=5,
    reading=lambda state, p: state.p1 * (1.0 + p["g_p1"]),
    symbols=("g_p1",),
    observed=True,
)
"""Input chamber pressure, absolute."""

P2 = MeasuredChannel(
    name="p2",
    unit="bar",
    scale=BAR,
    sensor=Sensor(low=1.0, high=16.0, accuracy=0.016, noise=0.0098, offset=-0.00728, trend=-1.16e-4),
    columns=("p2_bar",),
    decimals=5,
    reading=lambda state, p: (state.p2 + state.lag_2) * (1.0 + p["g_p2"]) + p["b_p2"],
    symbols=("b_p2", "g_p2"),
    observed=True,
    output=True,
)
"""Output chamber (circuit) pressure, absolute."""

P3 = MeasuredChannel(
    name="p3",
    unit="bar",
    scale=BAR,
    sensor=Sensor(low=1.0, high=16.0, accuracy=0.016, noise=0.0075, offset=-0.003112, trend=-8.2e-5),
    columns=("p3_bar",),
    decimals=5,
    reading=lambda state, p: (state.p3 + state.lag_3) * (1.0 + p["g_p3"]) + p["b_p3"],
    symbols=("b_p3", "g_p3"),
    observed=True,
    output=True,
)
"""Control chamber pressure, absolute."""

CURRENT = MeasuredChannel(
    name="I",
    unit="A",
    scale=1.0,
    sensor=Sensor(low=-1.0, high=1.0, accuracy=0.01, noise=0.0008, offset=-0.000235, trend=-6e-6),
    columns=("I_A",),
    decimals=6,
    reading=lambda state, p: state.I_coil * (1.0 + p["g_I"]),
    symbols=("g_I",),
    observed=True,
    output=True,
)
"""Solenoid current at the terminals."""

VOLTAGE = MeasuredChannel(
    name="U",
    unit="V",
    scale=1.0,
    sensor=Sensor(low=-32.0, high=32.0, accuracy=0.01, noise=0.0122, offset=0.001837, trend=5.8e-5),
    columns=("U_V",),
    decimals=5,
)
"""Solenoid voltage, fed back."""

MEASURED_CHANNELS = (P1, P2, P3, CURRENT, VOLTAGE)
"""Every measured channel; the noise of the environment is drawn in this order."""

CHANNEL = {channel.name: channel for channel in MEASURED_CHANNELS}
"""The records by name."""


MEASURED = tuple(channel.name for channel in MEASURED_CHANNELS if channel.observed)
"""Quantities that the environment measures; the bench measures them, too."""

SENSOR_SYMBOLS = tuple(symbol for channel in MEASURED_CHANNELS for symbol in channel.symbols)
"""Parameters of the sensors that are not in the plant's equations."""


def readings(state: State, p: Any) -> dict[str, Value]:
    """Values before noise and rounding, by channel [SI]; as the state but for effects of sensors.

    state: fields of any shape. p: SENSOR_SYMBOLS by name, numbers or arrays that broadcast to it. A
    channel that is an input of the bench (the voltage) has no reading here.
    """
    return {
        channel.name: channel.reading(state, p)
        for channel in MEASURED_CHANNELS
        if channel.reading is not None
    }


SENSORS: dict[str, Sensor] = {channel.name: channel.sensor for channel in MEASURED_CHANNELS}
"""Table 1's range and accuracy, Table 2's offset and trend, Table 3's standard deviation."""


def own_sensors(changes: Mapping[str, Mapping[str, float]]) -> dict[str, Sensor]:
    """Every channel's sensor, [bar absolute, A or V]; ParameterError for one that cannot be.

    changes: fields of `Sensor` by channel that differ from Tables 1 to 3.
    """
    sensors = dict(SENSORS)
    for name, fields in changes.items():
        if name not in SENSORS:
            raise ParameterError(f"sensors: unknown channel {name!r}: known are {', '.join(SENSORS)}")
        unknown = sorted(set(fields) - set(asdict(SENSORS[name])))
        if unknown:
            raise ParameterError(
                f"sensors.{name}: unknown field {unknown[0]!r}: known are "
                f"{', '.join(asdict(SENSORS[name]))}"
            )
        sensors[name] = replace(SENSORS[name], **fields)
        _check(name, sensors[name])
    return sensors


def changed_fields(sensors: Mapping[str, Sensor]) -> dict[str, dict[str, float]]:
    """What `own_sensors` was given: the fields that differ from Tables 1 to 3, by channel."""
    changed = {
        name: {field: v for field, v in asdict(sensor).items() if v != getattr(SENSORS[name], field)}
        for name, sensor in sensors.items()
    }
    return {name: fields for name, fields in changed.items() if fields}


def _check(name: str, sensor: Sensor) -> None:
    """Raises ParameterError for a sensor that could measure nothing."""
    place, unit = f"sensors.{name}", CHANNEL[name].unit
    for field, value in asdict(sensor).items():
        if not math.isfinite(value):
            raise ParameterError(f"{place}.{field} is {value}: give a finite number")
    if not sensor.low < sensor.high or sensor.high <= 0:
        raise ParameterError(
            f"{place} has the range [{sensor.low:g}, {sensor.high:g}] {unit}: give low < high, high > 0"
        )
    if unit == "bar" and sensor.low < 0:
        raise ParameterError(
            f"{place}.low = {sensor.low:g} bar lies below vacuum: give absolute ranges, not gauge"
        )
    if not 0 < sensor.accuracy <= 0.2:
        raise ParameterError(
            f"{place}.accuracy = {sensor.accuracy:g} must lie in (0, 0.2]: give it as a fraction of the "
            "range's end, 0.01 for 1 %"
        )
    if not 0 < sensor.noise <= 0.1 * (sensor.high - sensor.low):
        raise ParameterError(
            f"{place}.noise = {sensor.noise:g} {unit} must be positive and at most 0.1 of the range: "
            "give its standard deviation"
        )
