"""A second plant behind the grey-box protocol: a tank that is filled and drains through a pipe.

dh/dt = q/A - c sqrt(h): level h [m], inflow q known, c calibrated. What may be wrong: a leak that grows
with the level, a sensor that lags, an outlet that is off where the model has it.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from identification.gap.model import Cause, Channel, Nuisance, Run, Size

PERIOD, SAMPLES, NOISE = 0.5, 240, 2e-3
AREA = 0.5


def simulate(values: Mapping[str, NDArray], inflow: NDArray) -> NDArray:
    """Readings (samples, n) for values by symbol (n,)."""
    n = max(np.size(v) for v in values.values())
    p = {s: np.broadcast_to(values.get(s, off), n) for s, off in NOMINAL.items()}
    level = np.full(n, 0.5) + p["start"]
    read = level.copy()
    out = np.empty((len(inflow), n))
    for k, q in enumerate(inflow):
        out[k] = read + p["zero"]
        for _ in range(4):
            h = np.maximum(level, 1e-6)
            step = q / AREA - p["c"] * np.sqrt(h) - p["leak"] * h - p["evaporation"]
            level = level + 0.25 * PERIOD * step
        follow = 1 - np.exp(-PERIOD / np.maximum(p["lag"], 1e-3))
        read = read + follow * (level - read)
    return out


NOMINAL = {
    "c": 0.02, "leak": 0.0, "lag": 0.0, "evaporation": 0.0, "start": 0.0, "zero": 0.0, "area": 1.0,
}  # fmt: skip


def inflows(runs: int = 3) -> list[NDArray]:
    """Steps of the inflow [m^3/s]."""
    rng = np.random.default_rng(5)
    return [np.repeat(rng.uniform(0.002, 0.02, 6), SAMPLES // 6) for _ in range(runs)]


class Tank:
    """`GreyBox` for recordings of a tank with true values by symbol."""

    def __init__(self, truth: Mapping[str, float], seed: int = 0):
        rng = np.random.default_rng(seed)
        self.channels = (Channel(name="h", unit="m", scale=1.0, noise=NOISE),)
        self.runs = tuple(
            _run(k, inflow, truth, rng, held_out=k == 2) for k, inflow in enumerate(inflows())
        )
        self.parameters = (Size(symbol="c", unit="1/s", low=0.001, high=0.1, off=0.02, scale=0.02),)
        self.causes = (
            _cause("leak", "tank", 1e-3, 0.05),
            _cause("lag", "sensor", 2.0, 30.0),
            _cause("evaporation", "tank", 1e-4, 1e-2),
        )
        self.tolerances = ()
        self.starts = (
            Nuisance(symbol="start", sd=2e-3, step=1e-3),
            Nuisance(symbol="zero", sd=5e-4, step=1e-3),
        )

    def outputs(self, values: Mapping[str, NDArray], runs: Sequence[int]) -> list[NDArray]:
        """`GreyBox.outputs`."""
        return [simulate(values, self.runs[r].inputs["q"])[None] for r in runs]


def _cause(name: str, component: str, trial: float, high: float) -> Cause:
    size = Size(symbol=name, unit="1", low=0.0, high=high, trials=(trial,), scale=trial)
    return Cause(name=name, component=component, sizes=(size,))


def _run(k: int, inflow: NDArray, truth: Mapping[str, float], rng, *, held_out: bool) -> Run:
    clean = simulate({s: np.array([v]) for s, v in {**NOMINAL, **truth}.items()}, inflow)[:, 0]
    measured = (clean + NOISE * rng.standard_normal(len(clean)))[None]
    return Run(
        name=f"run {k}", held_out=held_out, time=np.arange(len(clean)) * PERIOD, measured=measured,
        trusted=np.ones(measured.shape, dtype=bool), inputs={"q": inflow},
    )  # fmt: skip
