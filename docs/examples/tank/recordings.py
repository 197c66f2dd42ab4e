"""The tank's recordings: CSV files, and a virtual tank that writes some."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from docs.examples.tank.simulator import levels, readings
from epv_env.common.files import write_text
from identification.gap.plant import Run

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
