"""A second plant for the diagnosis of a gap: a tank that may leak, from simulator to command.

python -m docs.examples.tank --out DIR, from the repository's root.

dh/dt = q/A - c sqrt(h/1 m) - leak h - evaporation: level h [m], inflow q known, c calibrated. The
nominal model has neither leak nor evaporation, and a sensor without lag.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from copy import copy

import numpy as np
from numpy.typing import NDArray

from docs.examples.recorded_plants import cause, write_down
from epv_env.common.command_line import fail_clearly
from epv_env.common.options import writable_folder
from identification.gap.diagnosis import diagnose
from identification.gap.plant import (
    Channel,
    FreeParameter,
    NuisanceParameter,
    Run,
    StateEquation,
    StateTrace,
)

AREA = 0.5
"""Cross-section of the tank [m^2]."""

START = 0.5
"""Level at which recordings begin [m]."""

NOMINAL = {
    "c": 0.02,  # rate at which a level of 1 m falls [m/s]
    "leak": 0.0,  # [1/s]
    "evaporation": 0.0,  # [m/s]
    "lag": 0.0,  # time constant of the sensor [s]
    "start": 0.0,  # level at the start, less START [m]
    "zero": 0.0,  # of the sensor on that day [m]
}
"""Values by symbol."""

SUBSTEPS = 4
"""Steps of Euler's method in a sampling period."""


def levels(
    values: Mapping[str, NDArray], inflow: NDArray, period: float, forcing: NDArray | None = None
) -> NDArray:
    """Level of n tanks side by side (samples, n) [m].

    values: by symbol, (n,). inflow: (samples,) [m^3/s]. period: of sampling [s]. forcing: added to
    dh/dt, (samples, n) [m/s].
    """
    forced = np.zeros((len(inflow), 1)) if forcing is None else forcing
    p = {**NOMINAL, **values}
    level = np.full(np.broadcast(forced[0], *p.values()).shape, START) + p["start"]
    course = []
    for q, own in zip(inflow, forced, strict=True):
        course.append(level)
        for _ in range(SUBSTEPS):
            h = np.maximum(level, 1e-6)
            rate = q / AREA - p["c"] * np.sqrt(h) - p["leak"] * h - p["evaporation"] + own
            level = level + period / SUBSTEPS * rate
    return np.array(course)


def readings(values: Mapping[str, NDArray], level: NDArray, period: float) -> NDArray:
    """Readings (samples, n) [m] of a sensor with a lag and a zero offset.

    values: by symbol, (n,) [SI]. level: (samples, n) [m]. period: of sampling [s].
    """
    p = {**NOMINAL, **values}
    follow = 1 - np.exp(-period / np.maximum(p["lag"], 1e-3))
    read = [level[0]]
    for now in level[1:]:
        read.append(read[-1] + follow * (now - read[-1]))
    return np.array(read) + p["zero"]


NOISE = 2e-3
"""Standard deviation of a reading [m], from a recording at rest."""

PERIOD, SAMPLES, RUNS = 0.5, 240, 3
"""Sampling period [s], samples per recording, and number of recordings of the virtual tank."""


def virtual_recordings(truth: Mapping[str, float], seed: int = 0) -> list[Run]:
    """Recordings of a virtual tank under random steps of the inflow; the last one is held out.

    truth: values of the tank by symbol [SI]. seed: of the noise.
    """
    steps, noise = np.random.default_rng(5), np.random.default_rng(seed)
    values = {symbol: np.array([value]) for symbol, value in truth.items()}
    runs = []
    for number in range(1, RUNS + 1):
        inflow = np.repeat(steps.uniform(0.002, 0.02, 6), SAMPLES // 6)
        clean = readings(values, levels(values, inflow, PERIOD), PERIOD)[:, 0]
        level = clean + NOISE * noise.standard_normal(SAMPLES)
        run = Run(
            name=f"test_{number}" if number < RUNS else "validation",
            held_out=number == RUNS,
            time=PERIOD * np.arange(SAMPLES),
            measured=level[None],
            trusted=np.ones((1, SAMPLES), dtype=bool),
            inputs={"q": inflow},
        )
        runs.append(run)
    return runs


class Tank:
    """`GreyBox` for recordings of a tank."""

    def __init__(self, runs: Sequence[Run]):
        self.runs = tuple(runs)
        self.channels = (Channel(name="h", unit="mm", scale=1e-3, noise=NOISE),)
        self.parameters = (
            FreeParameter(symbol="c", unit="m/s", low=0.001, high=0.1, nominal=NOMINAL["c"], scale=0.02),
        )
        self.causes = (
            cause("leak", "tank", "1/s", (1e-3,), (0.0, 0.05)),
            cause("lag", "sensor", "s", (2.0,), (0.0, 30.0)),
            cause("evaporation", "tank", "m/s", (1e-4,), (0.0, 1e-2)),
        )
        self.tolerances = ()
        self.run_offsets = (
            NuisanceParameter(symbol="start", sd=2e-3, step=1e-3),
            NuisanceParameter(symbol="zero", sd=5e-4, step=1e-3),
        )
        self.equations = (
            StateEquation(name="f1", state="h", component="tank", unit="mm/s", scale=1e-3, step=1e-4),
        )

    def with_runs(self, runs: Sequence[Run]) -> "Tank":
        """The tank with readings and inputs of which the faulty ones are mended."""
        other = copy(self)
        other.runs = tuple(runs)
        return other

    def outputs(self, values: Mapping[str, NDArray], runs: Sequence[int]) -> list[NDArray]:
        """`GreyBox.outputs`."""
        return [self._read(values, r)[None] for r in runs]

    def states(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, StateTrace]:
        """`GreyBox.states`: the level and the inflow."""
        q, period = self._inflow(run)
        level = levels(values, q, period)[:, 0]
        return {
            "h": StateTrace(unit="m", scale=1.0, values=level),
            "q": StateTrace(unit="l/s", scale=1e-3, values=q),
        }

    def regimes(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, NDArray]:
        """`GreyBox.regimes`."""
        rising = np.gradient(self.states(values, run)["h"].values) > 0
        return {"filling": rising, "draining": ~rising}

    def forced(self, values: Mapping[str, NDArray], run: int, forcing: Mapping[str, NDArray]) -> NDArray:
        """`GreyBox.forced`."""
        (acting,) = forcing.values()
        return (self._read(values, run, acting) - self._read(values, run))[None]

    def _read(self, values: Mapping[str, NDArray], run: int, forcing: NDArray | None = None) -> NDArray:
        """Readings (samples, n) of the level in a run."""
        q, period = self._inflow(run)
        return readings(values, levels(values, q, period, forcing), period)

    def _inflow(self, run: int) -> tuple[NDArray, float]:
        """And the sampling period."""
        return self.runs[run].inputs["q"], float(self.runs[run].time[1] - self.runs[run].time[0])


LEAKING = {"c": 0.021, "leak": 4e-3}
"""The virtual tank."""


def main() -> int:
    """Diagnose, write gap.json and report.html, print the verdict; returns the exit status."""
    parser = argparse.ArgumentParser(description="Why a model of a tank misses its recordings.")
    parser.add_argument("--out", type=writable_folder, required=True, help="folder of results")
    parser.add_argument("--seed", type=int, default=0, help="of resampling, and of the virtual noise")
    chosen = parser.parse_args()
    diagnosis = diagnose(Tank(virtual_recordings(LEAKING, chosen.seed)), seed=chosen.seed)
    write_down(diagnosis, chosen.out, "a tank")
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
