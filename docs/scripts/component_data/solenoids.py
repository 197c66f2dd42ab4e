"""Solenoids: current over case temperature, inductance over frequency."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import optimize

from docs.scripts.component_data.column_files import Array, columns
from docs.scripts.component_data.settings import DEFAULTS, ComponentSettings

MEASURED_SOLENOIDS = ("CB10370380", "CBS0730140", "SSBH-0830")
"""Solenoids that were measured at each stroke at three case temperatures or more."""
FREQUENCIES = np.array([1e2, 1e3, 1e4, 1e5])
"""Of the inductances [Hz]."""
INDUCTANCES = {
    "plunger out": np.array([65.3, 20.34, 4.31, 4.22]) * 1e-3,
    "plunger in": np.array([123.3, 16.28, 4.10, 4.23]) * 1e-3,
}
"""CBS07300580 of 51.9 ohm [H]: second sheet of work/Measure_vs_Calc/SolStrokeExp.xlsx in the solenoids'
repository, rows Neutral and Pushed. Its last column is headed 1 kHz, as the second is; it is 100 kHz,
for work/SolenoidStroke-L.xlsx, which names the solenoid, has the same 4.22 mH there."""


def temperature_slopes(data: Path, solenoid: str, settings: ComponentSettings = DEFAULTS) -> Array:
    """Relative slope of the current over the case temperature [1/K], (strokes,).

    Raises:
        ValueError: no stroke was measured at enough temperatures.
    """
    path = data / "solenoids" / f"SolPosMeas240805_{solenoid}.csv"
    table = columns(
        path, (0, 1, 2, 4), delimiter=",", header=1, convert=number_or_nan, settings=settings
    )
    temperature, place, on, current = table[:, np.isfinite(table).all(axis=0)]
    slopes = []
    for stroke in np.unique(place):
        chosen = (place == stroke) & np.isclose(on, settings.on_time)
        if len(np.unique(temperature[chosen])) >= settings.fewest_temperatures:
            slopes.append(np.polyfit(temperature[chosen], np.log(current[chosen]), 1)[0])
    if not slopes:
        raise ValueError(f"{path} has no stroke at three temperatures: take the file as published")
    return np.array(slopes)


def number_or_nan(text: str) -> float:
    """The number of a field; nan of an empty one."""
    return float(text or "nan")


@dataclass(frozen=True, kw_only=True)
class Inductor:
    """A coil as seen at its terminals."""

    inductance: float
    """Of the iron, at low frequency [H]."""
    eddy: float
    """Resistance of the iron's shorted turn in parallel [ohm]; its time constant [s] for diffusion."""
    leakage: float
    """Inductance in series, which the iron does not see [H]."""
    worst: float
    """Largest relative deviation [-]."""


def shorted_turn_inductance(
    frequency: Array, inductance: float, resistance: float, leakage: float
) -> Array:
    """Im(Z)/w of L in parallel with a resistance, and a leakage inductance in series [H], (n,).

    frequency: [Hz], (n,). inductance, leakage: [H]. resistance: [ohm].
    """
    return leakage + inductance / (1 + (2 * np.pi * frequency * inductance / resistance) ** 2)


def diffusion_inductance(frequency: Array, inductance: float, lag: float, leakage: float) -> Array:
    """The same for flux that diffuses into the iron: impedance as sqrt(w) above 1/lag [H], (n,).

    frequency: [Hz], (n,). inductance, leakage: [H]. lag: [s].
    """
    return leakage + np.real(inductance / np.sqrt(1 + 2j * np.pi * frequency * lag))


def fitted_inductor(
    frequency: Array, measured: Array, model: Callable[..., Array], second: float, leaks: bool = True
) -> Inductor:
    """Fit an inductor in relative deviations.

    Args:
        frequency: [Hz], (n,).
        measured: inductances [H], (n,).
        model: shorted_turn_inductance or diffusion_inductance.
        second: start of the model's second size, in its unit.
        leaks: whether a leakage inductance is fitted too.
    """

    def sizes(logs: Array) -> Array:
        return np.exp(logs) if leaks else np.r_[np.exp(logs), 0.0]

    start = np.log([measured[0], second, *([measured[-1]] if leaks else [])])
    fit = optimize.least_squares(lambda q: np.log(model(frequency, *sizes(q)) / measured), start)
    inductance, eddy, leakage = sizes(fit.x).tolist()
    worst = float(np.max(np.abs(np.expm1(fit.fun))))
    return Inductor(inductance=inductance, eddy=eddy, leakage=leakage, worst=worst)
