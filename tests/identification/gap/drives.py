"""A drive whose catalogue has thresholds and many causes, for the search: nearly static and so fast."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from identification.gap.black_box_plant import BlackBoxPlant
from identification.gap.plant import Cause, Channel, FreeParameter, NuisanceParameter, Run
from tests.identification.gap.ode_plants import quiet_run

NOISE, SAMPLES, PERIOD = 0.01, 300, 0.01
OFF = 3.0
"""A limit that nothing reaches."""

RANGES = {
    "dead_zone": (0.0, 1.0, 0.0, (0.1, 0.4)),
    "limit": (0.2, OFF, OFF, (0.7,)),
    "drag": (-1.0, 1.0, 0.0, (0.1,)),
    "lag": (0.0, 0.5, 0.0, (0.02,)),
    "drift": (-1.0, 1.0, 0.0, (0.05,)),
    "coupling": (-1.0, 1.0, 0.0, (0.1,)),
}
"""Lowest, highest and nominal value, and trials, by cause."""


class Drive(BlackBoxPlant):
    """y = gain (u beyond a dead zone, limited, lagged) + drag u|u| + drift t + coupling w + zero."""

    def __init__(
        self, truth: Mapping[str, float], *, names: Sequence[str] = tuple(RANGES), seed: int = 0
    ):
        """Record the drive.

        Args:
            truth: values that are not nominal.
            names: causes in the catalogue.
            seed: of the noise.
        """
        noise, runs = np.random.default_rng(seed), []
        for number, name in enumerate(("first", "second", "validation")):
            run = quiet_run(PERIOD, SAMPLES, **_inputs(number))
            y = _response(truth, run) + NOISE * noise.standard_normal((1, SAMPLES))
            runs.append(replace(run, name=name, held_out=name == "validation", measured=y))
        super().__init__(
            _response,
            channels=[Channel(name="y", unit="1", scale=1.0, noise=NOISE)],
            runs=runs,
            parameters=[FreeParameter(symbol="gain", unit="1", low=0.1, high=3.0, nominal=1.0)],
            causes=[_cause(name) for name in names],
            run_offsets=[NuisanceParameter(symbol="zero", sd=0.02, step=0.01)],
        )


def _cause(name: str) -> Cause:
    low, high, nominal, trials = RANGES[name]
    parameter = FreeParameter(
        symbol=name, unit="1", low=low, high=high, nominal=nominal, trials=trials, scale=trials[0]
    )
    return Cause(name=name, component="drive", parameters=(parameter,))


def _inputs(number: int) -> dict[str, NDArray]:
    """Command and second input of a run: a slow and a fast sine, and steps."""
    time, rng = PERIOD * np.arange(SAMPLES), np.random.default_rng(10 + number)
    slow, fast = rng.uniform(0.5, 1.0), rng.uniform(2.0, 3.0)
    u = 0.7 * np.sin(2 * np.pi * slow * time) + 0.3 * np.sin(2 * np.pi * fast * time + number)
    return {"u": u, "w": np.repeat(rng.uniform(-1.0, 1.0, 10), SAMPLES // 10)}


def _response(values: Mapping[str, float], run: Run) -> NDArray:
    """Outputs (1, samples)."""
    nominal = {name: value for name, (_, _, value, _) in RANGES.items()}
    p, u = {**nominal, "gain": 1.0, "zero": 0.0, **values}, run.inputs["u"]
    moved = np.clip(np.sign(u) * np.maximum(np.abs(u) - p["dead_zone"], 0.0), -p["limit"], p["limit"])
    kept = np.exp(-PERIOD / max(p["lag"], 1e-9))
    lagged = np.asarray(lfilter([1.0 - kept], [1.0, -kept], moved))
    others = p["drag"] * u * np.abs(u) + p["drift"] * run.time + p["zero"]
    return (p["gain"] * lagged + others + p["coupling"] * run.inputs["w"])[None]
