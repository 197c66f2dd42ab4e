"""Design of the PWM controller: linearise the averaged valve, and shape its loop with python-control.

Averaged over a PWM period, the control chamber fills for the duty d and vents for the rest, the piston
stands where its spring balances p3, and the circuit integrates the flow. Around an operating point with
the protection valve a little open this is an integrator behind a lag:

    d(p3)/dt = a p3 + b d,   d(p2)/dt = g p3          (deviations)

The loop is a cascade at the PWM period: p3 is fed back by a gain, p2 by a PI around it. The inner loop
takes the slow lag of the control chamber out of the outer loop.
"""

from dataclasses import dataclass

import control
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root_scalar

from epv_env.common.units import BAR
from epv_env.plant.coefficients import coefficients
from epv_env.plant.equations import Coefficients
from epv_env.plant.parameters import Parameters
from epv_env.plant.primitives import QUARTER_PI, mass_flux
from epv_env.plant.simulate import energised, simulate

OPENING = 0.05
"""Share of the stroke at which the plant is linearised [1]: barely open, where the loop works."""


@dataclass(frozen=True, kw_only=True)
class OperatingPoint:
    """Where the averaged valve rests barely open, and its linearisation there. SI units."""

    p3: float
    """Control pressure [Pa absolute]."""
    duty: float
    """Duty that holds p3 [1]."""
    a: float
    """Slope of dp3/dt over p3 [1/s]."""
    b: float
    """Slope of dp3/dt over duty [Pa/s]."""
    g: float
    """Slope of dp2/dt over p3 [1/s]; negative: a lower p3 opens the valve."""


def _static_stroke(p3: float, p1: float, p2: float, c: Coefficients) -> float:
    """Stroke at which the spring balances the pressures, within the stops [m] (eq. 22 at rest)."""
    seat_area = QUARTER_PI * c.seat_diameter**2
    force = (p1 - p3) * c.piston_area - (p1 - p2) * seat_area
    return float(np.clip(force / c.cPV - c.xPV0, 0.0, c.xPVmax))


def _p3_rate(p3: float, duty: float, p1: float, c: Coefficients) -> float:
    """Averaged dp3/dt [Pa/s]: the armature's flights are short against the period (eq. 7)."""
    fill = c.orifice_in * mass_flux(p1, p3, c.inverse_sqrt_RT)
    vent = c.orifice_exh * mass_flux(p3, c.p_env, c.inverse_sqrt_RT)
    return c.RT_V3 * (duty * fill - (1 - duty) * vent)


def switching_lag(p: Parameters, *, p1: float, p2: float, supply_voltage: float) -> float:
    """How much later the armature answers switching on than switching off [s], by simulation.

    The coil's current has to build up before it moves the armature; so the valve fills for less of a
    period than the coil is on.
    """
    sampling = 50e-6
    half = round(40e-3 / sampling)  # long against both answers
    U = np.repeat([supply_voltage, 0.0, supply_voltage], half)
    start = energised(p, p1=p1, p2=p2, U=supply_voltage)
    run = simulate(p, initial=start, U=U, period=sampling)
    pulled_in = np.asarray(run.state.xMV) > p["xMVmax"] / 2
    released = np.argmax(~pulled_in[half : 2 * half])
    answered = np.argmax(pulled_in[2 * half :])
    return float(answered - released) * sampling


def linearise(p: Parameters, *, p1: float, p2: float, opening: float = OPENING) -> OperatingPoint:
    """The averaged plant at a supply p1 and circuit pressure p2 [Pa absolute].

    opening: share of the stroke [1].
    """
    c = Coefficients(*coefficients(p)[:, 0].tolist())
    stroke = opening * c.xPVmax
    opens = root_scalar(lambda x: _static_stroke(x, p1, p2, c) - stroke, bracket=(c.p_env, p1))
    p3 = float(opens.root)
    duty = float(root_scalar(lambda d: _p3_rate(p3, d, p1, c), bracket=(0.0, 1.0)).root)
    small = 1e-3 * p3
    flux = mass_flux(p1, p2, c.inverse_sqrt_RT)
    opening_slope = -c.piston_area / c.cPV  # of the static stroke between its stops
    return OperatingPoint(
        p3=p3,
        duty=duty,
        a=(_p3_rate(p3 + small, duty, p1, c) - _p3_rate(p3 - small, duty, p1, c)) / (2 * small),
        b=(_p3_rate(p3, duty + 1e-3, p1, c) - _p3_rate(p3, duty - 1e-3, p1, c)) / 2e-3,
        g=c.RT_V2 * c.curtain_PV * opening_slope * flux,
    )


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

    Raises:
        ValueError: no gain keeps the margin.
    """
    point = linearise(p, p1=p1, p2=p2)
    pole, drift = np.exp(-period / inner_time), np.exp(point.a * period)
    lag = switching_lag(p, p1=p1, p2=p2, supply_voltage=supply_voltage)
    inner_gain = float((drift - pole) / ((drift - 1) / point.a * point.b / BAR))
    frequency = np.geomspace(0.1, np.pi / period, 400)  # up to half the sampling frequency [rad/s]
    z = np.exp(1j * frequency * period)
    unit = control.frd(outer_loop(point, inner_gain, integral_time, period, z), frequency)
    for gain in np.geomspace(3.0, 1e-2, 40):
        margin, phase, _, crossover = map(float, control.margin(gain * unit))
        if margin > 1 and phase >= phase_margin:
            return Design(
                inner_gain=inner_gain, outer_gain=float(gain), integral_time=integral_time,
                duty=point.duty + lag / period,
                gain_margin=margin, phase_margin=phase, crossover=crossover,
            )  # fmt: skip
    raise ValueError(
        f"no gain keeps a phase margin of {phase_margin:g} degrees with an integral time of "
        f"{integral_time:g} s at a period of {period:g} s: ask for less, or integrate more slowly"
    )
