"""A drive whose catalogue has thresholds and many causes, for the search: nearly static and so fast."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from identification.gap.plant import Cause, Channel, FreeParameter, NuisanceParameter, Run

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


class Drive:
    """y = gain (u beyond a dead zone, limited, lagged) + drag u|u| + drift t + coupling w + zero."""

    channels = (Channel(name="y", unit="1", scale=1.0, noise=NOISE),)
    parameters = (FreeParameter(symbol="gain", unit="1", low=0.1, high=3.0, nominal=1.0),)
    tolerances = ()
    run_offsets = (NuisanceParameter(symbol="zero", sd=0.02, step=0.01),)
    equations = ()

    def __init__(
        self, truth: Mapping[str, float], *, names: Sequence[str] = tuple(RANGES), seed: int = 0
    ):
        """Record the drive.

        Args:
            truth: values that are not nominal.
            names: causes in the catalogue.
            seed: of the noise.
        """
        self.causes = tuple(_cause(name) for name in names)
        noise = np.random.default_rng(seed)
        true = {symbol: np.array([value]) for symbol, value in truth.items()}
        made = []
        for number, name in enumerate(("first", "second", "validation")):
            inputs = _inputs(number)
            y = _response(true, inputs)[:, 0] + NOISE * noise.standard_normal(SAMPLES)
            made.append(
                Run(
                    name=name, held_out=name == "validation", time=PERIOD * np.arange(SAMPLES),
                    measured=y[None], trusted=np.ones((1, SAMPLES), dtype=bool), inputs=inputs,
                )
            )  # fmt: skip
        self.runs = tuple(made)

    def outputs(self, values: Mapping[str, NDArray], runs: Sequence[int]) -> list[NDArray]:
        """`GreyBox.outputs`."""
        return [_response(values, self.runs[r].inputs)[None] for r in runs]

    def states(self, values, run):
        """`GreyBox.states`."""
        return {}

    def regimes(self, values, run):
        """`GreyBox.regimes`."""
        return {}

    def forced(self, values, run, forcing):
        """`GreyBox.forced`: never, without equations."""
        raise NotImplementedError


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


def _response(values: Mapping[str, NDArray], inputs: Mapping[str, NDArray]) -> NDArray:
    """Outputs (samples, n)."""
    n = max((len(np.atleast_1d(value)) for value in values.values()), default=1)
    p = {name: np.full(n, nominal) for name, (_, _, nominal, _) in RANGES.items()}
    p |= {"gain": np.ones(n), "zero": np.zeros(n), **values}
    u, time = inputs["u"][:, None], PERIOD * np.arange(SAMPLES)
    moved = np.sign(u) * np.maximum(np.abs(u) - p["dead_zone"], 0.0)
    moved = np.clip(moved, -p["limit"], p["limit"])
    kept = np.exp(-PERIOD / np.maximum(p["lag"], 1e-9))
    lagged = np.stack(
        [lfilter([1.0 - k], [1.0, -k], own) for k, own in zip(kept, moved.T, strict=True)], axis=1
    )
    others = p["drag"] * u * np.abs(u) + np.outer(time, p["drift"]) + p["zero"]
    return p["gain"] * lagged + others + np.outer(inputs["w"], p["coupling"])
