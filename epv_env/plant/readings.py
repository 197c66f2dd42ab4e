"""What the sensors are given to read: the state, and what bias, gain and lag make of it."""

from collections.abc import Mapping

from epv_env.plant.equations import State
from epv_env.plant.values import Value

MEASURED = ("p1", "p2", "p3", "I")
"""Quantities that the bench and the environment measure."""

SENSOR_SYMBOLS = ("b_p2", "b_p3", "g_I")
"""Parameters of the sensors that are not in the plant's equations."""


def readings(state: State, p: Mapping[str, Value]) -> dict[str, Value]:
    """Values before noise and rounding, by name [Pa, A]; as the state but for effects of sensors.

    state: fields of any shape. p: SENSOR_SYMBOLS, numbers or arrays that broadcast to it.
    """
    return {
        "p1": state.p1,
        "p2": state.p2 + state.lag_2 + p["b_p2"],
        "p3": state.p3 + state.lag_3 + p["b_p3"],
        "I": state.I_coil * (1.0 + p["g_I"]),
    }
