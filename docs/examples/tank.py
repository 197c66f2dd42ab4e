"""A second plant for the diagnosis of a gap: a tank that may leak, from simulator to command.

python -m docs.examples.tank --out DIR, from the repository's root.

dh/dt = q/A - c sqrt(h/1 m) - leak h - evaporation: level h [m], inflow q known, c calibrated. The
nominal model has neither leak nor evaporation, and a sensor without lag.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from copy import copy
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from epv_env.common.command_line import fail_clearly
from epv_env.common.files import write_text
from epv_env.common.options import writable_folder
from identification.gap.diagnosis import diagnose
from identification.gap.plant import (
    Cause,
    Channel,
    FreeParameter,
    NuisanceParameter,
    Run,
    StateEquation,
    StateTrace,
)
from identification.gap.report.gap_json import write_results
from identification.gap.report.page import sections
from identification.gap.report.sentences import verdict_sentence
from identification.report.page import write_page

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


HEADER = "time_s,inflow_m3_per_s,level_m"

HELD_OUT = "validation"
"""Recordings whose names begin with this word are held out: no fit uses them."""

NOISE = 2e-3
"""Standard deviation of a reading [m], from a recording at rest."""

PERIOD, SAMPLES, RUNS = 0.5, 240, 3
"""Sampling period [s], samples per recording, and number of recordings of the virtual tank."""


def virtual_recordings(truth: Mapping[str, float], seed: int = 0) -> list[Run]:
    """Recordings of a virtual tank under random steps of the inflow.

    truth: values of the tank by symbol [SI]. seed: of the noise.
    """
    steps, noise = np.random.default_rng(5), np.random.default_rng(seed)
    values = {symbol: np.array([value]) for symbol, value in truth.items()}
    runs = []
    for number in range(1, RUNS + 1):
        inflow = np.repeat(steps.uniform(0.002, 0.02, 6), SAMPLES // 6)
        clean = readings(values, levels(values, inflow, PERIOD), PERIOD)[:, 0]
        name = f"test_{number}" if number < RUNS else HELD_OUT
        runs.append(as_run(name, PERIOD, inflow, clean + NOISE * noise.standard_normal(SAMPLES)))
    return runs


def as_run(name: str, period: float, inflow: NDArray, level: NDArray) -> Run:
    """A recording as the diagnosis sees it; every reading counts.

    period: of sampling [s]. inflow: (samples,) [m^3/s]. level: readings, (samples,) [m].
    """
    return Run(
        name=name,
        held_out=name.startswith(HELD_OUT),
        time=period * np.arange(len(level)),
        measured=level[None],
        trusted=np.ones((1, len(level)), dtype=bool),
        inputs={"q": inflow},
    )


def write_runs(runs: Sequence[Run], folder: Path) -> None:
    """Write one CSV file for each recording."""
    for run in runs:
        table = np.stack([run.time, run.inputs["q"], run.measured[0]], axis=1).tolist()
        lines = [HEADER, *(",".join(f"{cell:.7g}" for cell in row) for row in table)]
        write_text(folder / f"{run.name}.csv", "\n".join(lines) + "\n")


def read_runs(folder: Path) -> list[Run]:
    """All recordings of a folder, by name. Raises ValueError for a file that cannot be used."""
    paths = sorted(folder.glob("*.csv"))
    if not paths:
        raise ValueError(f"{folder} has no CSV files: give a folder of recordings")
    return [_read(path) for path in paths]


def _read(path: Path) -> Run:
    lines = path.read_text(encoding="utf-8").splitlines()
    if not lines or lines[0] != HEADER:
        raise ValueError(f"{path}, line 1: the header is not {HEADER}: name the columns so")
    try:
        time, inflow, level = np.loadtxt(lines[1:], delimiter=",", ndmin=2).T
    except ValueError as error:
        raise ValueError(f"{path}: {error}: give every line three numbers") from None
    period = time[-1] / max(len(time) - 1, 1)
    if period <= 0 or not np.allclose(time, period * np.arange(len(time)), atol=1e-3 * period):
        raise ValueError(f"{path}: time_s is not uniform from 0: resample the recording")
    if not np.all(np.isfinite([inflow, level])):
        raise ValueError(f"{path}: a cell is not finite: cut the recording before it")
    return as_run(path.stem, float(period), inflow, level)


class Tank:
    """`GreyBox` for recordings of a tank."""

    def __init__(self, runs: Sequence[Run]):
        self.runs = tuple(runs)
        self.channels = (Channel(name="h", unit="mm", scale=1e-3, noise=NOISE),)
        self.parameters = (
            FreeParameter(symbol="c", unit="m/s", low=0.001, high=0.1, nominal=NOMINAL["c"], scale=0.02),
        )
        self.causes = (
            _cause("leak", "tank", "1/s", trial=1e-3, high=0.05),
            _cause("lag", "sensor", "s", trial=2.0, high=30.0),
            _cause("evaporation", "tank", "m/s", trial=1e-4, high=1e-2),
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


def _cause(name: str, component: str, unit: str, *, trial: float, high: float) -> Cause:
    """A cause with one parameter of the same name, which is 0 in the nominal model."""
    parameter = FreeParameter(symbol=name, unit=unit, low=0.0, high=high, trials=(trial,), scale=trial)
    return Cause(name=name, component=component, parameters=(parameter,))


LEAKING = {"c": 0.021, "leak": 4e-3}
"""The virtual tank; its recordings are written to --out, and read from there."""


def main() -> int:
    """Diagnose, write gap.json and report.html, print the verdict; returns the exit status."""
    parser = argparse.ArgumentParser(description="Why a model of a tank misses its recordings.")
    parser.add_argument("--out", type=writable_folder, required=True, help="folder of results")
    parser.add_argument("--recordings", type=Path, default=None, help="folder of your own CSV files")
    parser.add_argument("--seed", type=int, default=0, help="of resampling, and of the virtual noise")
    chosen = parser.parse_args()
    folder = chosen.recordings
    if folder is None:
        folder = chosen.out / "recordings"
        write_runs(virtual_recordings(LEAKING, chosen.seed), folder)
    diagnosis = diagnose(Tank(read_runs(folder)), seed=chosen.seed)
    write_results(diagnosis, chosen.out)
    title = f"Gap between model and recordings: {folder}"
    write_page(chosen.out / "report.html", title=title, sections=sections(diagnosis))
    print(verdict_sentence(diagnosis)[1])
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
