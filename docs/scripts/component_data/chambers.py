"""Leaks of chambers: three laws, each a rate of pressure over pressure, at constant temperature."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import integrate, optimize

from docs.scripts.component_data.column_files import Array, columns
from docs.scripts.component_data.settings import DEFAULTS, ComponentSettings
from epv_env.common.units import BAR
from epv_env.plant.primitives import mass_flux

LEAKY_CHAMBERS = ("Ultimaker_015", "Ultimaker_020")
TIGHT_CHAMBERS = ("Aluminium", "Formlabs", "Prusa", "Ultimaker_006", "Ultimaker_010")
AMBIENT = 1.01325e5
"""Pressure outside [Pa]; the authors did not record it."""
SENSOR_ZERO = 3.4e3
"""Reading of the chambers' sensor at no pressure [Pa]: where the record of the leakiest one ends."""
GAS_CONSTANT_TIMES_TEMPERATURE = 287.05 * 293.15
"""R T of the air at 20 degrees [J/kg]."""


def orifice_rate(pressure: Array, area: float) -> Array:
    """Fall of the pressure [Pa/s] through an orifice of effective area over volume [1/m]."""
    flux = [mass_flux(p, AMBIENT, GAS_CONSTANT_TIMES_TEMPERATURE**-0.5) for p in pressure]
    return area * GAS_CONSTANT_TIMES_TEMPERATURE * np.array(flux)


def laminar_rate(pressure: Array, conductance: float) -> Array:
    """Fall of the pressure [Pa/s] through a laminar leak [1/(Pa s)]."""
    return conductance * (pressure**2 - AMBIENT**2)


def porous_rate(pressure: Array, viscous: float, inertial: float) -> Array:
    """Fall m of the pressure [Pa/s] by Forchheimer's law viscous m + inertial m^2 = p^2 - p_env^2."""
    drop = pressure**2 - AMBIENT**2
    return 2 * drop / (viscous + np.sqrt(viscous**2 + 4 * inertial * drop))


LAWS: dict[str, tuple[Callable[..., Array], tuple[float, ...]]] = {
    "orifice": (orifice_rate, (2e-4,)),
    "laminar": (laminar_rate, (1e-7,)),
    "porous": (porous_rate, (5e6, 200.0)),
}
"""Rates by law, with what a fit starts from."""


@dataclass(frozen=True, kw_only=True)
class FittedDecay:
    """A law fitted to a chamber's pressure."""

    sizes: tuple[float, ...]
    """The law's sizes, as in LAWS."""
    rms: float
    """Root mean square of the residual [Pa]."""
    pressure: Array
    """The fitted pressure [Pa]."""


def pressure_decay(time: Array, start: float, rate: Callable[[Array], Array]) -> Array:
    """Pressure [Pa] from a start: the equation separates, dt = -dp/rate, so no integrator is needed."""
    grid = AMBIENT + (start - AMBIENT) * np.geomspace(1, 1e-4, 600)
    elapsed = -integrate.cumulative_trapezoid(1 / rate(grid), grid, initial=0)
    return np.interp(time, elapsed, grid)


def fitted_decay(time: Array, pressure: Array, law: str) -> FittedDecay:
    """Fit a law from the first reading on (absolute pressure)."""
    rate, guess = LAWS[law]

    def at(logs: Array) -> Array:
        *sizes, start = np.exp(logs)
        return pressure_decay(time, start, lambda p: rate(p, *sizes))

    begin = np.log([*guess, pressure[0]])
    fit = optimize.least_squares(lambda logs: (at(logs) - pressure) / BAR, begin)
    rms = BAR * float(np.sqrt(np.mean(fit.fun**2)))
    return FittedDecay(sizes=tuple(np.exp(fit.x[:-1]).tolist()), rms=rms, pressure=at(fit.x))


def read_chamber(
    data: Path, chamber: str, settings: ComponentSettings = DEFAULTS
) -> tuple[Array, Array]:
    """Time [s] and absolute pressure [Pa] of a chamber, (samples,) each, from its file."""
    path = data / "chambers" / f"{chamber}.csv"
    time, gauge = columns(path, (0, 2), delimiter=";", convert=plain_number, settings=settings)
    return time * 1e-3, gauge * BAR - SENSOR_ZERO + AMBIENT


def plain_number(text: str) -> float:
    """A number that may carry a dot for thousands too: 1.234.567 is 1234.567 ms, 5.000 is 5 ms."""
    return float(text.replace(".", "", max(text.count(".") - 1, 0)))


def after_release(
    time: Array, pressure: Array, settings: ComponentSettings = DEFAULTS
) -> tuple[Array, Array]:
    """A leaky chamber's record from the moment its supply is shut: time [s] and pressure [Pa].

    time: [s], (samples,). pressure: absolute [Pa], (samples,).
    """
    filled = pressure[: settings.filled_samples].mean()
    first = int(np.argmax(pressure < filled - settings.release_drop))
    return time[first:] - time[first], pressure[first:]


def relative_decay_rate(time: Array, pressure: Array, start: float, end: float) -> float:
    """Mean rate of decay of a tight chamber's pressure, relative to the pressure [1/s].

    Args:
        time: [s], (samples,).
        pressure: absolute [Pa], (samples,).
        start, end: the span of time [s].
    """
    inside = (time >= start) & (time < end)
    return float(-np.polyfit(time[inside], pressure[inside], 1)[0] / pressure[inside].mean())


def settling(
    time: Array, pressure: Array, settings: ComponentSettings = DEFAULTS
) -> tuple[float, float]:
    """Size [Pa] and time constant [s] of the settling after filling, beside a steady decay.

    time: [s], (samples,). pressure: absolute [Pa], (samples,).
    """

    def fitted(lag: float) -> tuple[float, float]:
        """Size [Pa], and sum of squares [Pa^2], at this time constant [s]."""
        terms = np.column_stack([np.ones_like(time), time, np.exp(-time / lag)])
        coefficients, squares = np.linalg.lstsq(terms, pressure, rcond=None)[:2]
        return float(coefficients[2]), float(squares[0])

    lags = np.geomspace(*settings.settling_times, settings.settling_points).tolist()
    best = min(lags, key=lambda lag: fitted(lag)[1])
    return fitted(best)[0], best


def effective_area(rate: Callable[..., Array], sizes: tuple[float, ...], pressure: float) -> float:
    """Area of the orifice through which as much flows at an absolute pressure, per litre [m^2]."""
    at = np.array([pressure])
    return 1e-3 * float((rate(at, *sizes) / orifice_rate(at, 1.0))[0])
