"""Design of the PWM controller: shape the loop of the linearised valve with python-control.

The loop is a cascade at the PWM period: p3 is fed back by a gain, p2 by a PI around it. The inner loop
takes the slow lag of the control chamber out of the outer loop.
"""

from dataclasses import dataclass

import control
import numpy as np
from numpy.typing import NDArray

from controllers.pwm_linearisation import OPENING, OperatingPoint, linearise, switching_lag
from epv_env.common.units import BAR
from epv_env.plant.parameters import Parameters


@dataclass(frozen=True, kw_only=True)
class DesignSettings:
    """How the loop is linearised and its gain searched."""

    opening: float = OPENING
    """Share of the stroke at which the plant is linearised [1]."""
    largest_gain: float = 3.0
    """Largest outer gain that is tried [1]."""
    smallest_gain: float = 1e-2
    """Smallest outer gain that is tried [1]."""
    gains: int = 40
    """Number of gains between them, in equal ratios."""
    frequencies: int = 400
    """Number of frequencies at which the loop's margins are read."""


DESIGN = DesignSettings()
"""The design of the PWM controller."""


@dataclass(frozen=True, kw_only=True)
class Design:
    """Gains of the cascade, and margins of the outer loop."""

    inner_gain: float
    """Duty per bar of control pressure [1/bar]."""
    outer_gain: float
    """Bar of control pressure per bar of circuit pressure [1]."""
    integral_time: float
    """Tn of the outer PI [s]."""
    duty: float
    """Duty that holds the operating point, the armature's lag included."""
    gain_margin: float
    """Of the outer loop [1]."""
    phase_margin: float
    """Of the outer loop [degrees]."""
    crossover: float
    """Gain crossover [rad/s]."""
    point: OperatingPoint
    """Where the valve was linearised."""
    period: float
    """Of the PWM [s]."""

    def __str__(self) -> str:
        return (
            f"gain margin {self.gain_margin:.2f}, phase margin {self.phase_margin:.0f} degrees, "
            f"crossover {self.crossover:.1f} rad/s"
        )


def outer_loop(
    point: OperatingPoint, inner_gain: float, integral_time: float, period: float, z: NDArray
) -> NDArray:
    """Frequency response of the open outer loop at unit gain, at the points z (k,) of the z-plane.

    The valve, sampled with a zero-order hold, with p3 fed back through inner_gain, behind the PI. The
    sign makes it positive, since a lower p3 raises p2.
    """
    continuous = control.ss([[point.a, 0.0], [point.g, 0.0]], [[point.b / BAR], [0.0]], [[0.0, 1.0]], 0)
    valve = control.sample_system(continuous, period, method="zoh")
    A, B = np.asarray(valve.A), np.asarray(valve.B)
    closed = control.ss(A - inner_gain * B @ np.array([[1.0, 0.0]]), inner_gain * B, valve.C, 0, period)
    pi = 1 + period / integral_time / (z - 1)
    return -pi * closed(z)


def response(
    point: OperatingPoint,
    inner_gain: float,
    integral_time: float,
    period: float,
    frequencies: int = DESIGN.frequencies,
) -> control.FrequencyResponseData:
    """`outer_loop` from 0.1 rad/s to half the sampling frequency, as python-control takes it."""
    frequency = np.geomspace(0.1, np.pi / period, frequencies)
    z = np.exp(1j * frequency * period)
    return control.frd(outer_loop(point, inner_gain, integral_time, period, z), frequency)


def open_loop(d: Design) -> control.FrequencyResponseData:
    """Frequency response of a design's open loop, from p2's error to p2."""
    return d.outer_gain * response(d.point, d.inner_gain, d.integral_time, d.period)


def design(
    p: Parameters,
    *,
    p1: float,
    p2: float,
    inner_time: float,
    phase_margin: float,
    integral_time: float,
    period: float,
    supply_voltage: float = 24.0,
    settings: DesignSettings = DESIGN,
) -> Design:
    """The largest outer gain that keeps a phase margin on the discrete loop.

    Args:
        p: parameters of the plant.
        p1: supply pressure [Pa absolute].
        p2: circuit pressure [Pa absolute].
        inner_time: wanted time constant of the p3 loop [s].
        phase_margin: least one of the outer loop [degrees].
        integral_time: Tn of the outer PI [s].
        period: of the PWM [s].
        supply_voltage: of the coil when on [V].
        settings: of linearisation and search.

    Raises:
        ValueError: no gain keeps the margin.
    """
    point = linearise(p, p1=p1, p2=p2, opening=settings.opening)
    pole, drift = np.exp(-period / inner_time), np.exp(point.a * period)
    lag = switching_lag(p, p1=p1, p2=p2, supply_voltage=supply_voltage)
    inner_gain = float((drift - pole) / ((drift - 1) / point.a * point.b / BAR))
    unit = response(point, inner_gain, integral_time, period, settings.frequencies)
    for gain in np.geomspace(settings.largest_gain, settings.smallest_gain, settings.gains):
        margin, phase, _, crossover = map(float, control.margin(gain * unit))
        if margin > 1 and phase >= phase_margin:
            return Design(
                inner_gain=inner_gain, outer_gain=float(gain), integral_time=integral_time,
                duty=point.duty + lag / period,
                gain_margin=margin, phase_margin=phase, crossover=crossover, point=point, period=period,
            )  # fmt: skip
    raise ValueError(
        f"no gain keeps a phase margin of {phase_margin:g} degrees with an integral time of "
        f"{integral_time:g} s at a period of {period:g} s: ask for less, or integrate more slowly"
    )
