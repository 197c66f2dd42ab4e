"""The drive of a toy car of 1:10 (DART), recorded by others: m dv/dt = (a - b v) throttle - c v.

python -m docs.examples.toy_car --data FOLDER --out DIR, from the repository's root. The nominal model is
linear in the throttle, and its friction is viscous.
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from docs.examples.recorded_plants import cause, command, found, run_of
from epv_env.common.command_line import fail_clearly
from identification.gap.ode_plant import OdePlant
from identification.gap.plant import Channel, FreeParameter, Run

SOURCE = (
    "github.com/Lorenzo-Lyons/DART (MIT): the CSV files of "
    "System_identification/Data/20_step_input_data_rubbery_floor"
)

MASS = 1.58
"""Of the car [kg], by its makers."""

PERIOD = 0.1
"""Sampling period [s]; the time stamps scatter by some milliseconds."""

QUANTUM = 0.04
"""Step of the encoder's readings [m/s]."""

STEEPNESS = 7.67
"""Of the friction's change of sign at standstill [s/m], by the car's makers."""

SHORTEST_LAG = 0.03
"""A lag [s] shorter than this is a part of one of this length: the state stays easy to integrate."""


def rate(x: Any, u: Any, p: Any) -> Sequence[Any]:
    """Rates of speed [m/s^2] and of the lagging throttle [1/s]."""
    command = max(u.throttle - p.dead_zone, 0.0)
    share = min(p.drive_lag / SHORTEST_LAG, 1.0)
    throttle = command + share * (x.drive - command)
    driving = (p.a - p.b * x.v) * throttle
    braking = p.c * x.v + p.air_drag * x.v * abs(x.v) + p.rolling_friction * np.tanh(STEEPNESS * x.v)
    lag = max(p.drive_lag, SHORTEST_LAG)
    return (driving - braking + p.slope) / MASS, (command - x.drive) / lag


def readings(x: Any, u: Any, p: Any) -> Sequence[Any]:
    """What the encoder reads [m/s]."""
    return (x.v * p.encoder_scale,)


def start(run: Run, p: Any) -> Sequence[Any]:
    """Speed as read, and the throttle off."""
    return run.measured[0, 0], 0.0


def toy_car(folder: Path) -> OdePlant:
    """The plant with the recordings in a folder; every other one is held out."""
    return OdePlant(
        runs=recordings(folder),
        channels=[Channel(name="v", unit="m/s", scale=1.0, noise=QUANTUM / 12**0.5)],
        states=("v", "drive"),
        rate=rate,
        readings=readings,
        start=start,
        parameters=[
            FreeParameter(symbol="a", unit="N", low=0.1, high=200.0, nominal=10.0, scale=10.0),
            FreeParameter(symbol="b", unit="N s/m", low=0.0, high=100.0, nominal=2.0, scale=2.0),
            FreeParameter(symbol="c", unit="N s/m", low=0.0, high=20.0, nominal=0.5, scale=0.5),
        ],
        causes=[
            cause("dead_zone", "drive", "1", (0.1, 0.03, 0.2), (0.0, 0.5)),
            cause("rolling_friction", "wheels", "N", (0.5, 0.1, 2.0), (0.0, 10.0)),
            cause("drive_lag", "drive", "s", (0.1, 0.03, 0.3), (0.0, 2.0)),
            cause("air_drag", "body", "N s²/m²", (0.1, 0.02, 0.5), (0.0, 5.0)),
            cause("encoder_scale", "sensor", "1", (1.1, 0.9, 1.3), (0.5, 2.0), nominal=1.0),
            cause("command_delay", "drive", "s", (0.1, 0.03, 0.3), (0.0, 1.0)),
            cause("slope", "body", "N", (0.2, -0.2, 1.0, -1.0), (-3.0, 3.0)),
        ],
        components={"v": "body", "drive": "drive"},
        units={"v": ("m/s", 1.0), "drive": ("1", 1.0), "throttle": ("1", 1.0)},
        forcing_steps={"v": 0.05, "drive": 0.05},
        delays={"throttle": "command_delay"},
        steps_per_sample=4,
    )


def recordings(folder: Path) -> list[Run]:
    """The recordings by name; the second, fourth and so on are held out."""
    paths = sorted(found(folder, SOURCE).glob("*.csv"))
    if len(paths) < 2:
        raise FileNotFoundError(f"{folder} has fewer than two CSV files: get them from {SOURCE}")
    runs = []
    for number, path in enumerate(paths):
        table = np.loadtxt(path, delimiter=",", skiprows=1).T
        throttle = {"throttle": table[8] * (table[7] == 1)}
        runs.append(run_of(path.stem, PERIOD, table[6:7], throttle, held_out=number % 2 == 1))
    return runs


if __name__ == "__main__":
    sys.exit(fail_clearly(lambda: command("a toy car", toy_car)))
