"""Leaks of chambers: three laws, each a rate of pressure over pressure, at constant temperature."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import integrate, optimize

from docs.component_data.files import Array, columns
from epv_env.plant.flow import mass_flux

LEAKY = ("Ultimaker_015", "Ultimaker_020")
TIGHT = ("Aluminium", "Formlabs", "Prusa", "Ultimaker_006", "Ultimaker_010")
AMBIENT = 1.01325e5
"""Pressure outside, which nobody recorded [Pa]."""
ZERO = 3.4e3
"""Reading of the chambers' sensor at no pressure [Pa]: where the record of the leakiest one ends."""
LONGEST_SETTLING = 60.0
"""Beyond this a record of 145 s cannot tell settling from leaking [s]."""
RT = 287.05 * 293.15
"""R T of the air at 20 degrees [J/kg]."""


def orifice_rate(pressure: Array, area: float) -> Array:
    """Fall of the pressure [Pa/s] through an orifice of effective area over volume [1/m]."""
    flux = [mass_flux(p, AMBIENT, RT**-0.5) for p in pressure]
    return area * RT * np.array(flux)


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
class Decay:
    """A law fitted to a chamber's pressure."""

    sizes: tuple[float, ...]
    """The law's sizes, as in LAWS."""
    rms: float
    """Root mean square of the residual [Pa]."""
    pressure: Array
    """The fitted pressure [Pa]."""


def decay_over(time: Array, start: float, rate: Callable[[Array], Array]) -> Array:
    """Pressure [Pa] from a start: the equation separates, dt = -dp/rate, so no integrator is needed."""
    grid = AMBIENT + (start - AMBIENT) * np.geomspace(1, 1e-4, 600)
    elapsed = -integrate.cumulative_trapezoid(1 / rate(grid), grid, initial=0)
    return np.interp(time, elapsed, grid)


def fitted_decay(time: Array, pressure: Array, law: str) -> Decay:
    """Fit a law from the first reading on (absolute pressure)."""
    rate, guess = LAWS[law]

    def at(logs: Array) -> Array:
        *sizes, start = np.exp(logs)
        return decay_over(time, start, lambda p: rate(p, *sizes))

    begin = np.log([*guess, pressure[0]])
    fit = optimize.least_squares(lambda logs: (at(logs) - pressure) / 1e5, begin)
    rms = 1e5 * float(np.sqrt(np.mean(fit.fun**2)))
    return Decay(sizes=tuple(np.exp(fit.x[:-1]).tolist()), rms=rms, pressure=at(fit.x))


def read_chamber(data: Path, chamber: str) -> tuple[Array, Array]:
    """Time [s] and absolute pressure [Pa]."""
    path = data / "chambers" / f"{chamber}.csv"
    time, gauge = columns(path, (0, 2), delimiter=";", convert=plain_number)
    return time * 1e-3, gauge * 1e5 - ZERO + AMBIENT


def plain_number(text: str) -> float:
    """A number that may carry a dot for thousands too: 1.234.567 is 1234.567 ms, 5.000 is 5 ms."""
    return float(text.replace(".", "", max(text.count(".") - 1, 0)))


def released(time: Array, pressure: Array) -> tuple[Array, Array]:
    """A leaky chamber's record from the moment its supply is shut."""
    first = int(np.argmax(pressure < pressure[:20].mean() - 0.03e5))
    return time[first:] - time[first], pressure[first:]


def fall(time: Array, pressure: Array, start: float, end: float) -> float:
    """Mean fall of a tight chamber's pressure over a span of time, over the pressure [1/s]."""
    inside = (time >= start) & (time < end)
    return float(-np.polyfit(time[inside], pressure[inside], 1)[0] / pressure[inside].mean())


def settling(time: Array, pressure: Array) -> tuple[float, float]:
    """Size [Pa] and time constant [s] of what settles after filling, beside a steady fall."""

    def rest(lag: float) -> tuple[float, float]:
        terms = np.column_stack([np.ones_like(time), time, np.exp(-time / lag)])
        found, left = np.linalg.lstsq(terms, pressure, rcond=None)[:2]
        return float(found[2]), float(left[0])

    lags = np.geomspace(1, LONGEST_SETTLING, 80).tolist()
    best = min(lags, key=lambda lag: rest(lag)[1])
    return rest(best)[0], best


def effective_area(rate: Callable[..., Array], sizes: tuple[float, ...], pressure: float) -> float:
    """Area of the orifice through which as much flows at an absolute pressure, per litre [m^2]."""
    at = np.array([pressure])
    return 1e-3 * float((rate(at, *sizes) / orifice_rate(at, 1.0))[0])
