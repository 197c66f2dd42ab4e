"""The tank behind the protocol that the diagnosis knows (identification/gap/plant.py)."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from docs.examples.tank.recordings import NOISE
from docs.examples.tank.simulator import NOMINAL, levels, readings
from identification.gap.plant import (
    Cause,
    Channel,
    FreeParameter,
    NuisanceParameter,
    Run,
    StateEquation,
    StateTrace,
)


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

    def forced(
        self, values: Mapping[str, NDArray], equation: StateEquation, run: int, edges: NDArray
    ) -> NDArray:
        """`GreyBox.forced`."""
        samples = np.arange(len(self.runs[run].time))
        window = np.searchsorted(edges, samples, side="right")[:, None] - 1
        acting = equation.step * (window == np.arange(len(edges) - 1))
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
