"""A pendulum that swings freely, recorded by others: angle'' = -w2 sin(angle) - c angle' [rad].

python -m docs.examples.pendulum --data FOLDER --out DIR, from the repository's root. The nominal model
has viscous friction alone; angles count from hanging.
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat

from docs.examples.recorded_plants import cause, command, found, run_of
from epv_env.common.command_line import fail_clearly
from identification.gap.ode_plant import OdePlant
from identification.gap.plant import Channel, FreeParameter, NuisanceParameter, Run

FILE = "SinglePendulumDataForParameterEstimation.mat"
SOURCE = f"github.com/dynamicslab/MultiArm-Pendulum (MIT): ParameterEstimation/SinglePendulum/{FILE}"

PERIOD, EVERY = 1e-3, 10
"""Sampling period of the recording [s]; every tenth sample is used."""

NOISE = 4e-5
"""Scatter of the angle about a smooth curve over 0.1 s [rad]; the makers have filtered it."""

BEGINNING = 100
"""Recorded samples from which the angle and the speed at the start are taken."""

FITTED = 2 / 3
"""Share of the swing that is fitted to; the rest is held out."""

SHORTEST_LAG = 0.01
"""A lag [s] shorter than this is a part of one of this length: the state stays easy to integrate."""


def rate(x: Any, u: Any, p: Any) -> Sequence[Any]:
    """Rates of angle [rad/s], speed [rad/s^2] and lagging reading [rad/s]."""
    pulled = p.w2 * np.sin(x.angle) + p.pivot_stiffness * x.angle**3
    braked = p.c * x.speed + p.coulomb_friction * np.sign(x.speed)
    drag = p.quadratic_drag * x.speed * abs(x.speed)
    lag = max(p.sensor_lag, SHORTEST_LAG)
    return x.speed, -pulled - braked - drag, (x.angle - x.read) / lag


def readings(x: Any, u: Any, p: Any) -> Sequence[Any]:
    """What the encoder reads [rad]."""
    share = min(p.sensor_lag / SHORTEST_LAG, 1.0)
    return (p.angle_gain * (x.angle + share * (x.read - x.angle)) + p.angle_offset,)


def turning(x: Any, u: Any, p: Any) -> Sequence[Any]:
    """Coulomb friction changes its sign with the speed."""
    return (x.speed,)


def start(run: Run, p: Any) -> Sequence[Any]:
    """Angle and speed as the first readings have them."""
    angle = p.start_angle
    return angle, p.start_speed, angle


def pendulum(folder: Path) -> OdePlant:
    """The plant with the recording in a folder: two thirds are fitted, the last third is held out."""
    runs, angle, speed = recordings(folder)
    return OdePlant(
        runs=runs,
        channels=[Channel(name="angle", unit="rad", scale=1.0, noise=NOISE)],
        states=("angle", "speed", "read"),
        rate=rate,
        readings=readings,
        start=start,
        thresholds=turning,
        parameters=[
            FreeParameter(symbol="w2", unit="1/s²", low=30.0, high=120.0, nominal=64.0, scale=64.0),
            FreeParameter(symbol="c", unit="1/s", low=0.0, high=2.0, nominal=0.067, scale=0.05),
        ],
        causes=[
            cause("coulomb_friction", "bearing", "rad/s²", (0.1, 0.02, 0.5), (0.0, 5.0)),
            cause("quadratic_drag", "bob", "1/rad", (0.01, 2e-3, 0.05), (0.0, 1.0)),
            cause("angle_offset", "sensor", "rad", (0.01, -0.01, 0.05, -0.05), (-0.3, 0.3)),
            cause("angle_gain", "sensor", "1", (1.02, 0.98, 1.1, 0.9), (0.7, 1.4), nominal=1.0),
            cause("sensor_lag", "sensor", "s", (0.02, 5e-3, 0.1), (0.0, 0.5)),
            cause("pivot_stiffness", "bearing", "1/s²/rad²", (1.0, -1.0, 5.0, -5.0), (-20.0, 20.0)),
        ],
        run_offsets=[
            NuisanceParameter(symbol="start_angle", centre=angle, sd=5e-3, step=1e-3),
            NuisanceParameter(symbol="start_speed", centre=speed, sd=0.05, step=5e-3),
        ],
        components={"angle": "bob", "speed": "bob", "read": "sensor"},
        units={"angle": ("rad", 1.0), "speed": ("rad/s", 1.0), "read": ("rad", 1.0)},
        forcing_steps={"speed": 0.01},
        steps_per_sample=2,
    )


def recordings(folder: Path) -> tuple[list[Run], float, float]:
    """Two runs from the start, and the angle [rad] and speed [rad/s] there."""
    pieces = loadmat(str(found(folder / FILE, SOURCE)))
    cells = [cell[0] for name in ("Y_id", "Y_vad") for cell in pieces[name].ravel()]
    swing = np.concatenate(cells) - np.pi
    slopes = np.polyfit(PERIOD * np.arange(BEGINNING), swing[:BEGINNING], 3)
    angle = swing[None, ::EVERY]
    cut = round(FITTED * angle.shape[1])
    period = PERIOD * EVERY
    first = run_of("first", period, angle[:, :cut].copy(), {}, held_out=False)
    rest = run_of("rest", period, angle.copy(), {}, held_out=True, begin=cut)
    return [first, rest], float(slopes[-1]), float(slopes[-2])


if __name__ == "__main__":
    sys.exit(fail_clearly(lambda: command("a pendulum", "pendulum", pendulum)))
