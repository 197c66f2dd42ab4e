"""Linearisation of the valve averaged over a PWM period.

Averaged over a PWM period, the control chamber fills for the duty d and vents for the rest, the piston
stands where its spring balances p3, and the circuit integrates the flow. Around an operating point with
the protection valve a little open this is an integrator behind a lag:

    d(p3)/dt = a p3 + b d,   d(p2)/dt = g p3          (deviations)
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import root_scalar

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


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    """Zero of a function that changes sign between low and high."""
    return float(root_scalar(function, bracket=(low, high)).root)


def linearise(p: Parameters, *, p1: float, p2: float, opening: float = OPENING) -> OperatingPoint:
    """The averaged plant at a supply p1 and circuit pressure p2 [Pa absolute].

    opening: share of the stroke [1].
    """
    c = Coefficients(*coefficients(p)[:, 0].tolist())
    stroke = opening * c.xPVmax
    p3 = _root(lambda x: _static_stroke(x, p1, p2, c) - stroke, c.p_env, p1)
    duty = _root(lambda d: _p3_rate(p3, d, p1, c), 0.0, 1.0)
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
