"""The measured channels: one record each, from which sensors, readings and recordings are built."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from epv_env.common.units import BAR
from epv_env.plant.data_acquisition import Sensor
from epv_env.plant.equations import State
from epv_env.plant.primitives.values import Value

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
        for fault in _faults(self):
            raise ChannelError(f"measured channel {self.name!r}: {fault}")


def _faults(channel: MeasuredChannel) -> list[str]:
    """What is missing or wrong in a record, each with its remedy."""
    faults = [
        f"{field} is empty: fill it in"
        for field in ("name", "unit", "columns")
        if not getattr(channel, field)
    ]
    if channel.scale <= 0.0:
        faults.append(f"scale is {channel.scale:g}: give the size of one {channel.unit} in SI units")
    if channel.reading is None and (channel.output or channel.observed or channel.symbols):
        faults.append("an output or observed channel needs `reading`: give a function of the state")
    return faults


P1 = MeasuredChannel(
    name="p1",
    unit="bar",
    scale=BAR,
    sensor=Sensor(low=1.0, high=16.0, accuracy=0.016, noise=0.0068, offset=0.000909, trend=7.9e-5),
    columns=("p1_bar", "p1a_bar", "p1b_bar"),
    decimals=5,
    reading=lambda state, p: state.p1,
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
    reading=lambda state, p: state.p2 + state.lag_2 + p["b_p2"],
    symbols=("b_p2",),
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
    reading=lambda state, p: state.p3 + state.lag_3 + p["b_p3"],
    symbols=("b_p3",),
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
