"""Effects of sensors and of the command's timing."""

from collections.abc import Mapping

import numpy as np

from epv_env.plant.effects.record import Constant, Effect, Size, rate
from epv_env.plant.primitives import Value, inlined


def _lag_constants(number: int) -> tuple[Constant, ...]:
    """Constants of a first-order sensor of p2 or p3."""
    symbol = f"tau_p{number}"
    return (
        # 1 where the sensor of p{number} lags, else 0 [-]
        Constant(f"lag_{number}_on", lambda p: np.sign(rate(p[symbol]))),
        # reciprocal of its time constant [1/s]
        Constant(f"lag_{number}_rate", lambda p: rate(p[symbol])),
    )


PRESSURE_SENSOR_LAG = Effect(
    name="pressure_sensor_lag",
    component="sensor",
    strength=("lag_2_rate", "lag_3_rate"),
    form="τ dy/dt = p − y",
    source="first-order sensor with its line",
    sizes=tuple(
        Size(
            symbol=f"tau_{channel}",
            unit="s",
            domain=(0, 0.1),
            meaning=f"time constant of the sensor of {channel}",
            trials=(0.005,),
            least_fitted=2e-4,
            drawn=(1e-3, 2e-2),
        )
        for channel in ("p2", "p3")
    ),
    alternatives={"p2": ("tau_p2",), "p3": ("tau_p3",)},
    constants=(*_lag_constants(2), *_lag_constants(3)),
    fastest_rate=lambda p: np.maximum(rate(p["tau_p2"]), rate(p["tau_p3"])),
)

PRESSURE_SENSOR_BIAS = Effect(
    name="pressure_sensor_bias",
    component="sensor",
    form="y = p + b",
    source="Table 1: 1.6 % of 16 bar is 0.26 bar",
    sizes=tuple(
        Size(
            symbol=f"b_{channel}",
            unit="Pa",
            domain=(-100000.0, 100000.0),
            meaning=f"bias of the sensor of {channel}",
            trials=(5e3,),
            drawn=(2.5e3, 2.5e4),
            either_sign=True,
        )
        for channel in ("p2", "p3")
    ),
    alternatives={"p2": ("b_p2",), "p3": ("b_p3",)},
)

PRESSURE_SENSOR_GAIN = Effect(
    name="pressure_sensor_gain",
    component="sensor",
    form="y = (1 + g) p",
    source="ratiometric sensors follow their supply: 4.92 V instead of 5 V are 1.6 %; Table 1: 1.6 %",
    sizes=tuple(
        Size(
            symbol=f"g_{channel}",
            unit="1",
            domain=(-0.1, 0.1),
            meaning=f"scale error of the sensor of {channel}",
            trials=(0.01,),
            drawn=(3e-3, 4e-2),
            either_sign=True,
        )
        for channel in ("p1", "p2", "p3")
    ),
    alternatives={"p1": ("g_p1",), "p2": ("g_p2",), "p3": ("g_p3",)},
)

CURRENT_SENSOR_GAIN = Effect(
    name="current_sensor_gain",
    component="sensor",
    form="y = (1 + g) I",
    source="scale error of shunt and amplifier; Table 1: 1 %",
    sizes=(
        Size(
            symbol="g_I",
            unit="1",
            domain=(-0.2, 0.2),
            meaning="scale error of the current sensor",
            trials=(0.02,),
            drawn=(5e-3, 0.1),
            either_sign=True,
        ),
    ),
)

COMMAND_DELAY = Effect(
    name="command_delay",
    component="timing",
    form="the coil follows U after t_delay (1 − w_delay) to on (U > 1 V), t_delay (1 + w_delay) to off",
    source="sampling, network and power stage; stages switch on and off at different speeds",
    sizes=(
        Size(
            symbol="t_delay",
            unit="s",
            domain=(0, 0.01),
            meaning="time after which the coil follows the voltage",
            trials=(1e-3, 4e-3),
            drawn=(3e-4, 6e-3),
        ),
        Size(
            symbol="w_delay",
            unit="1",
            domain=(-1, 1),
            meaning="share of the delay that switching off has more and switching on less",
            spread=0.5,
        ),
    ),
)


def command_delays(p: Mapping[str, Value]) -> tuple[Value, Value]:
    """Times after which the coil follows a voltage that switches it on, and off [s]."""
    return p["t_delay"] * (1.0 - p["w_delay"]), p["t_delay"] * (1.0 + p["w_delay"])


@inlined
def lag_rate(lag, rate, on, per_time):
    """Rate of a first-order sensor's reading less the pressure, which changes at `rate` [Pa/s]."""
    return -per_time * lag - on * rate
