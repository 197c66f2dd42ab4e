"""Two heaters and two thermometers on a board (TCLab), recorded by others.

python -m docs.examples.thermal_lab --data FOLDER --out DIR, from the repository's root.

m c dT/dt = U A (ambient - T) + alpha Q for each heater. The nominal model has convection alone, and its
thermometers are at the heaters' temperature.
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numba
import numpy as np

from docs.examples.recorded_plants import cause, command, found, run_of
from epv_env.common.command_line import fail_clearly
from identification.gap.ode_plant import OdePlant
from identification.gap.plant import Channel, FreeParameter, NuisanceParameter, Run

FILE = "energy_balance_mimo_data.txt"
SOURCE = (
    "github.com/APMonitor/arduino (Apache-2.0): save "
    f"2_Regression/Energy_balance_MIMO/Python_minimize/data.txt as {FILE}"
)

AREA, BETWEEN = 1e-3, 2e-4
"""Surface of a heater to the air, and of each heater towards the other [m^2]."""

STEFAN_BOLTZMANN, KELVIN = 5.67e-8, 273.15
"""Of radiation [W/m^2/K^4], and 0 degrees Celsius [K]."""

SHORTEST_LAG = 2.0
"""A lag [s] shorter than this is a part of one of this length: the state stays easy to integrate."""

REST, FITTED = 8, 300
"""Samples before the heaters act, and samples that are fitted to."""


@numba.njit
def heat(T: Any, Q: Any, alpha: Any, p: Any) -> Any:
    """Heat that flows into one heater at T [C] with the power setting Q [%], [W]."""
    ambient = p.ambient + p.ambient_offset
    radiated = STEFAN_BOLTZMANN * AREA * ((T + KELVIN) ** 4 - (ambient + KELVIN) ** 4)
    power = alpha * Q * (1 + p.heater_nonlinearity * Q / 100)
    return p.U * AREA * (ambient - T) + power - p.radiation * radiated


def rate(x: Any, u: Any, p: Any) -> Sequence[Any]:
    """Rates of heaters and thermometers [°C/s]."""
    between = p.heater_coupling * BETWEEN * (x.T2 - x.T1)
    lag = max(p.sensor_lag, SHORTEST_LAG)
    return (
        (heat(x.T1, u.Q1, p.alpha1, p) + between) / p.heat_capacity,
        (heat(x.T2, u.Q2, p.alpha2, p) - between) / p.heat_capacity,
        (x.T1 - x.C1) / lag,
        (x.T2 - x.C2) / lag,
    )


def readings(x: Any, u: Any, p: Any) -> Sequence[Any]:
    """What the thermometers read [C]."""
    share = min(p.sensor_lag / SHORTEST_LAG, 1.0)
    return x.T1 + share * (x.C1 - x.T1), x.T2 + share * (x.C2 - x.T2)


def start(run: Run, p: Any) -> Sequence[Any]:
    """Heaters and thermometers at rest [C]."""
    T1, T2 = np.mean(run.measured[:, :REST], axis=1)
    return T1 + p.start_1, T2 + p.start_2, T1 + p.start_1, T2 + p.start_2


def thermal_lab(folder: Path) -> OdePlant:
    """The plant with the recording in a folder: fitted up to 300 s, held out from there on."""
    runs = recordings(folder)
    ambient = float(np.mean(runs[0].measured[:, :REST]))
    return OdePlant(
        runs=runs,
        channels=[Channel(name=name, unit="°C", scale=1.0, noise=0.12) for name in ("T1", "T2")],
        states=("T1", "T2", "C1", "C2"),
        rate=rate,
        readings=readings,
        start=start,
        parameters=[
            FreeParameter(symbol="U", unit="W/m²/K", low=0.5, high=100.0, nominal=10.0, scale=10.0),
            FreeParameter(symbol="alpha1", unit="W/%", low=5e-4, high=0.1, nominal=0.01, scale=0.01),
            FreeParameter(symbol="alpha2", unit="W/%", low=5e-4, high=0.1, nominal=0.0075, scale=0.01),
        ],
        causes=[
            cause("heater_coupling", "heater", "W/m²/K", (10.0, 1.0, 100.0), (0.0, 500.0)),
            cause("sensor_lag", "sensor", "s", (10.0, 3.0, 30.0), (0.0, 120.0)),
            cause("radiation", "heater", "1", (0.5, 0.1, 0.9), (0.0, 1.0)),
            cause("ambient_offset", "heater", "K", (1.0, -1.0, 5.0, -5.0), (-10.0, 10.0)),
            cause("heater_nonlinearity", "heater", "1", (0.3, -0.3, 1.0), (-0.8, 5.0)),
            cause("heat_capacity", "heater", "J/K", (4.0, 1.0, 8.0), (0.2, 20.0), nominal=0.004 * 500),
        ],
        run_offsets=[
            NuisanceParameter(symbol="start_1", sd=0.1, step=0.05),
            NuisanceParameter(symbol="start_2", sd=0.1, step=0.05),
        ],
        tolerances=[NuisanceParameter(symbol="ambient", centre=ambient, sd=0.3, step=0.1)],
        components={"T1": "heater", "T2": "heater", "C1": "sensor", "C2": "sensor"},
        units=dict.fromkeys(("T1", "T2", "C1", "C2"), ("°C", 1.0))
        | {"Q1": ("%", 1.0), "Q2": ("%", 1.0)},
        forcing_steps={"T1": 1e-2, "T2": 1e-2},
        steps_per_sample=1,
    )


def recordings(folder: Path) -> list[Run]:
    """One run from the start to 300 s, and the whole one, of which the rest is held out."""
    table = np.loadtxt(found(folder / FILE, SOURCE), delimiter=",", skiprows=1).T
    period = float(table[0, -1] / (table.shape[1] - 1))
    runs = []
    for name, held_out, begin, end in (("first", False, 0, FITTED), ("rest", True, FITTED, None)):
        inputs = {"Q1": table[1, :end], "Q2": table[2, :end]}
        runs.append(run_of(name, period, table[3:5, :end].copy(), inputs, held_out, begin))
    return runs


if __name__ == "__main__":
    sys.exit(fail_clearly(lambda: command("a thermal lab", thermal_lab)))
