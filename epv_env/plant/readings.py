"""What the sensors are given to read: the state, and what bias, gain and lag make of it."""

from collections.abc import Mapping

from epv_env.plant.channels import MEASURED_CHANNELS
from epv_env.plant.equations import State
from epv_env.plant.primitives.values import Value

MEASURED = tuple(channel.name for channel in MEASURED_CHANNELS if channel.observed)
"""Quantities that the environment measures; the bench measures them, too."""

SENSOR_SYMBOLS = tuple(symbol for channel in MEASURED_CHANNELS for symbol in channel.symbols)
"""Parameters of the sensors that are not in the plant's equations."""


def readings(state: State, p: Mapping[str, Value]) -> dict[str, Value]:
    """Values before noise and rounding, by channel [SI]; as the state but for effects of sensors.

    state: fields of any shape. p: SENSOR_SYMBOLS, numbers or arrays that broadcast to it. A channel that
    is an input of the bench (the voltage) has no reading here.
    """
    return {
        channel.name: channel.reading(state, p)
        for channel in MEASURED_CHANNELS
        if channel.reading is not None
    }
