"""The three virtual plants: a tank, a motor and an oscillator; their laws and their catalogues.

The other law of a cause, of which the truth takes a share, stands beside the catalogue's; it acts alike
at a usual size, and both vanish without the cause. Strangers act in the truth alone. Values are SI.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

from identification.gap.plant import Cause, Channel, FreeParameter, NuisanceParameter

HIDDEN = "lagged", "hidden", "hidden_too"
"""States of the truth alone: of a second lag of the sensor, and of strangers."""


@dataclass(frozen=True, kw_only=True)
class System:
    """A virtual plant without recordings."""

    states: dict[str, tuple[str, float]]
    """By state of the model its component, and a small change of its rate [SI/s]."""
    rate: Callable[..., Any]
    """Rates (x, u, p, deviation, lagged) of the model's states; compiled."""
    readings: Any
    """Readings (x, u, p, deviation); compiled, and as `readings.py_func` for arrays."""
    truth: Callable[..., Any]
    """Rates (x, u, p) of the model's states and of HIDDEN; compiled."""
    start: Callable[[Any], tuple[float, ...]]
    """From p, the truth's states at the first sample."""
    channels: tuple[Channel, ...]
    parameters: tuple[FreeParameter, ...]
    tolerances: tuple[NuisanceParameter, ...]
    run_offsets: tuple[NuisanceParameter, ...]
    causes: tuple[Cause, ...]
    """The size of a cause has the cause's name as its symbol."""
    strangers: Mapping[str, float]
    """Largest size of each mechanism that the catalogue has not [SI]."""
    period: float
    """Sampling period [s]."""
    command: tuple[float, float]
    """Centre and half range of the command [SI]."""
    sweep: tuple[float, float]
    """First and last frequency of a sweep [Hz]."""
    steps: int = 1
    """Runge-Kutta steps of the model in a sampling period."""


@numba.njit
def law(assumed, other, deviation):
    """A law of which a share, `deviation`, is another one."""
    return assumed + deviation * (other - assumed)


@numba.njit
def direction(x, width):
    """The sign of x, which changes smoothly over a width."""
    return x / np.sqrt(x * x + width * width)


@numba.njit
def limited(command, share, deviation):
    """A command of at most 1 [1] that is cut at 1 - share; or bends towards that."""
    cut = min(max(command, share - 1.0), 1.0 - share)
    return law(cut, command * (1.0 - share * command * command), deviation)


@numba.njit
def sensor(true, read, lag, base, lagged, deviation):
    """Rate of a reading that follows in base + lag [s]; a share of the lag is of second order."""
    second = deviation * lag / (base + lag)
    return (true + second * (lagged - true) - read) / (base + lag)


def _parameter(symbol: str, unit: str, nominal: float) -> FreeParameter:
    return FreeParameter(
        symbol=symbol, unit=unit, low=0.6 * nominal, high=1.6 * nominal, nominal=nominal
    )


def _cause(name: str, component: str, unit: str, high: float, *trials: float) -> Cause:
    """A cause of one size [SI], which has both signs where a trial has."""
    low = -high if min(trials) < 0.0 else 0.0
    size = FreeParameter(symbol=name, unit=unit, low=low, high=high, trials=trials)
    return Cause(name=name, component=component, parameters=(size,))


def _nuisance(symbol: str, sd: float, centre: float = 0.0) -> NuisanceParameter:
    return NuisanceParameter(symbol=symbol, sd=sd, centre=centre, step=0.1 * sd)


@numba.njit
def _tank(x, u, p, d, lagged):
    """Level [m], speed of the pump [1], read level [m]."""
    duty = limited(u.command, p.pump_limit, d)
    out = p.outlet * x.level / np.sqrt(abs(x.level) + 1e-3)
    out *= 1.0 - p.clogging * law(u.t / 800.0, (u.t / 800.0) ** 2, d)
    above = max(x.level - 0.35, 0.0)
    lost = p.leak * law(x.level, x.level * abs(x.level) / 0.4, d)
    lost += p.overflow * law(above, above * np.sqrt(above) / 0.3, d)
    balance = (_inflow(x, p, d) - out - lost) / p.area
    read = sensor(x.level, x.read, p.level_lag, 3.0, lagged, d)
    return balance, (duty - x.speed) / 6.0, read


@numba.njit
def _inflow(x, p, d):
    """Of the pump [m^3/s]."""
    head = law(x.level, x.level * np.abs(x.level) / 0.4, d)
    return p.pump * x.speed * (1.0 - p.back_pressure * head)


@numba.njit
def _tank_readings(x, u, p, d):
    bend = p.level_bend * law(x.read**2, x.read**3 / 0.4, d)
    return x.read + bend + p.zero, _inflow(x, p, d)


@numba.njit
def _true_tank(x, u, p):
    """A second tank behind a valve; foam, which the sensor sees; rain."""
    level, speed, read = _tank(x, u, p, p.deviation, x.lagged)
    across = p.second_tank * (x.level - x.hidden)
    level += p.rain * (1.0 + np.sin(0.05 * u.t)) - across
    read += p.foam * x.hidden_too / (3.0 + p.level_lag)
    hidden = (x.level - x.lagged) / (3.0 + p.level_lag), 0.3 * across, x.speed**2 - x.hidden_too / 40.0
    return level, speed, read, *hidden


TANK = System(
    states={"level": ("vessel", 1e-4), "speed": ("pump", 1e-3), "read": ("sensor", 1e-4)},
    rate=_tank,
    readings=_tank_readings,
    truth=_true_tank,
    start=lambda p: (0.25 + p.level_0, 0.5, 0.25 + p.level_0, 0.25 + p.level_0, 0.25, 0.0),
    channels=(
        Channel(name="level", unit="mm", scale=1e-3, noise=1.5e-3),
        Channel(name="flow", unit="l/s", scale=1e-3, noise=3e-6),
    ),
    parameters=(_parameter("pump", "m^3/s", 4e-4), _parameter("outlet", "m^2.5/s", 4e-4)),
    tolerances=(_nuisance("area", 2e-4, 0.02),),
    run_offsets=(_nuisance("level_0", 5e-3), _nuisance("zero", 1e-3)),
    causes=(
        _cause("leak", "vessel", "m^2/s", 4e-4, 2e-5, 1e-4),
        _cause("overflow", "vessel", "m^2/s", 5e-3, 5e-4),
        _cause("clogging", "outlet", "1", 0.8, 0.1, 0.4),
        _cause("pump_limit", "pump", "1", 0.7, 0.2, 0.5),
        _cause("back_pressure", "pump", "1/m", 1.5, 0.1, 0.5),
        _cause("delay", "timing", "s", 30.0, 2.0, 8.0),
        _cause("level_lag", "sensor", "s", 60.0, 4.0, 20.0),
        _cause("level_bend", "sensor", "1/m", 0.8, 0.1, -0.1),
    ),
    strangers={"second_tank": 3e-2, "foam": 5e-2, "rain": 5e-3},
    period=2.0,
    command=(0.5, 0.5),
    sweep=(0.002, 0.02),
)


@numba.njit
def _motor(x, u, p, d, lagged):
    """Current [A], speed [rad/s], warmth of the winding [1], read speed [rad/s]."""
    volts = 12.0 * limited(u.command / 12.0, p.voltage_limit, d)
    volts -= p.brush_drop * law(direction(x.current, 0.7), x.current / (abs(x.current) + 1.0), d)
    resistance = p.resistance * (1.0 + p.heating * x.warmth)
    large = abs(x.current) / 6.0
    field = p.field / (1.0 + p.saturation * law(large**2, large, d))
    current = (volts - resistance * x.current - field * x.speed) / 0.016
    friction = law(1.0, 0.5 + 1.0 / (1.0 + (x.speed / 40.0) ** 2), d)
    torque = (
        field * x.current
        - p.weight
        - p.viscous * x.speed
        - p.coulomb * friction * direction(x.speed, 5.0)
    )
    warmth = (law(large**2, large, d) - x.warmth) / 0.5
    return current, torque / p.inertia, warmth, sensor(x.speed, x.read, p.tacho_lag, 8e-3, lagged, d)


@numba.njit
def _motor_readings(x, u, p, d):
    fast = np.abs(x.read) / 100.0
    return x.current + p.zero, x.read * (1.0 + p.tacho_bend * law(fast, fast**2, d))


@numba.njit
def _true_motor(x, u, p):
    """A flywheel behind a slipping clutch; an unbalanced arm; a load that comes and goes."""
    current, speed, warmth, read = _motor(x, u, p, p.deviation, x.lagged)
    slip = p.flywheel * (x.speed - x.hidden)
    speed -= (slip + p.unbalance * np.sin(x.hidden_too) + p.load * np.sin(20.0 * u.t)) / p.inertia
    hidden = (x.speed - x.lagged) / (8e-3 + p.tacho_lag), slip / 1e-4, x.speed
    return current, speed, warmth, read, *hidden


MOTOR = System(
    states={
        "current": ("winding", 10.0), "speed": ("shaft", 20.0), "warmth": ("winding", 0.0),
        "read": ("sensor", 20.0),
    },
    rate=_motor,
    readings=_motor_readings,
    truth=_true_motor,
    start=lambda p: (0.0,) * 7,
    channels=(
        Channel(name="current", unit="A", scale=1.0, noise=0.05),
        Channel(name="speed", unit="rad/s", scale=1.0, noise=0.5),
    ),
    parameters=(
        _parameter("resistance", "Ohm", 1.0), _parameter("field", "V s", 0.05),
        _parameter("inertia", "kg m^2", 2e-4), _parameter("viscous", "N m s", 2e-4),
    ),
    tolerances=(_nuisance("weight", 1e-3),),
    run_offsets=(_nuisance("zero", 0.02),),
    causes=(
        _cause("coulomb", "shaft", "N m", 0.08, 5e-3, 0.02),
        _cause("heating", "winding", "1", 2.0, 0.1, 0.5),
        _cause("saturation", "winding", "1", 1.0, 0.05, 0.3),
        _cause("voltage_limit", "driver", "1", 0.7, 0.2, 0.4),
        _cause("brush_drop", "driver", "V", 2.0, 0.2, 0.8),
        _cause("delay", "timing", "s", 0.04, 4e-3, 0.012),
        _cause("tacho_lag", "sensor", "s", 0.08, 4e-3, 0.016),
        _cause("tacho_bend", "sensor", "1", 0.4, 0.05, -0.05),
    ),
    strangers={"flywheel": 1e-3, "unbalance": 0.08, "load": 0.08},
    period=4e-3,
    command=(0.0, 12.0),
    sweep=(1.0, 8.0),
)  # fmt: skip


@numba.njit
def _oscillator(x, u, p, d, lagged):
    """Position [m], velocity [m/s], read position [m]."""
    push = p.gain * limited(u.command, p.drive_limit, d) + p.tilt
    far, play = abs(x.position), p.play
    strained = law(max(far - play, 0.0), far * far / (far + play + 1e-9), d) * np.sign(x.position)
    spring = p.frequency**2 * strained
    spring += p.hardening * x.position**3 * law(1.0, (x.position / 0.4) ** 2, d)
    beyond = max(x.position - 0.2, 0.0)
    spring += p.stop * law(beyond, beyond * np.sqrt(beyond) / 0.3, d)
    friction = law(1.0, 0.5 + 1.0 / (1.0 + (x.velocity / 0.4) ** 2), d) * direction(x.velocity, 0.05)
    rate = push - spring - p.damping * x.velocity - p.coulomb * friction
    return x.velocity, rate, sensor(x.position, x.read, p.sensor_lag, 0.05, lagged, d)


@numba.njit
def _oscillator_readings(x, u, p, d):
    return (x.read + p.sensor_bend * law(x.read * np.abs(x.read), x.read**3 / 0.4, d) + p.zero,)


@numba.njit
def _true_oscillator(x, u, p):
    """A stiffness that changes periodically; an attached mass; gusts."""
    position, velocity, read = _oscillator(x, u, p, p.deviation, x.lagged)
    pull = p.attached_mass * (x.position - x.hidden)
    velocity -= p.periodic_stiffness * p.frequency**2 * x.position * np.sin(4.4 * u.t) + pull
    velocity += p.gusts * np.sin(2.3 * u.t)
    lagged = (x.position - x.lagged) / (0.05 + p.sensor_lag)
    return position, velocity, read, lagged, x.hidden_too, 8.0 * pull - 0.5 * x.hidden_too


OSCILLATOR = System(
    states={"position": ("mass", 0.0), "velocity": ("mass", 0.05), "read": ("sensor", 0.02)},
    rate=_oscillator,
    readings=_oscillator_readings,
    truth=_true_oscillator,
    start=lambda p: (p.position_0, 0.0, p.position_0, p.position_0, p.position_0, 0.0),
    channels=(Channel(name="position", unit="mm", scale=1e-3, noise=5e-3),),
    parameters=(
        _parameter("frequency", "rad/s", 6.28), _parameter("damping", "1/s", 0.8),
        _parameter("gain", "m/s^2", 6.0),
    ),
    tolerances=(_nuisance("tilt", 0.02),),
    run_offsets=(_nuisance("position_0", 0.01), _nuisance("zero", 2e-3)),
    causes=(
        _cause("coulomb", "guide", "m/s^2", 1.0, 0.05, 0.3),
        _cause("hardening", "spring", "1/(m s)^2", 150.0, 5.0, 30.0),
        _cause("play", "spring", "m", 0.06, 5e-3, 0.02),
        _cause("stop", "frame", "1/s^2", 200.0, 5.0, 40.0),
        _cause("drive_limit", "drive", "1", 0.8, 0.3, 0.5),
        _cause("delay", "timing", "s", 0.4, 0.03, 0.12),
        _cause("sensor_lag", "sensor", "s", 0.6, 0.03, 0.12),
        _cause("sensor_bend", "sensor", "1/m", 1.5, 0.1, -0.1),
    ),
    strangers={"periodic_stiffness": 0.4, "attached_mass": 8.0, "gusts": 3.0},
    period=0.04,
    steps=2,
    command=(0.0, 1.0),
    sweep=(0.5, 1.6),
)  # fmt: skip

SYSTEMS = {"tank": TANK, "motor": MOTOR, "oscillator": OSCILLATOR}
