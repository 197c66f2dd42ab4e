"""A plant whose simulator is a black box: a function of one candidate, whose states nobody sees."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.model.cause import Cause
from identification.gap.model.free_parameter import FreeParameter, NuisanceParameter
from identification.gap.model.recorded_run import Channel, Run
from identification.gap.model.state_equation import StateEquation, StateTrace

Simulate = Callable[[Mapping[str, float], Run], NDArray]
"""Simulator of one candidate: (values of all symbols [SI], run) to outputs (channels, samples) [SI].

It raises ArithmeticError where a candidate cannot be simulated.
"""

Regimes = Callable[[Run, NDArray], Mapping[str, NDArray]]
"""(run, outputs (channels, samples) [SI]) to boolean (samples,) by regime."""


class BlackBoxPlant:
    """`GreyBox` around a function that simulates one candidate at a time.

    Nothing is known of states and equations: a gap is located by channel, reading and regime, and drawn
    over inputs and outputs, but in no equation.
    """

    def __init__(
        self,
        simulate: Simulate,
        *,
        channels: Sequence[Channel],
        runs: Sequence[Run],
        parameters: Sequence[FreeParameter],
        causes: Sequence[Cause] = (),
        tolerances: Sequence[NuisanceParameter] = (),
        run_offsets: Sequence[NuisanceParameter] = (),
        regimes: Regimes | None = None,
        executor: Executor | None = None,
    ):
        """Describe the plant; `GreyBox` says what each member means.

        Args:
            simulate: the simulator. It is called once per candidate and run, with values for the symbols
                of all parameters, causes and nuisances.
            channels: measured outputs, in the order of the simulator's.
            runs: recordings; the simulator receives one of them, with its inputs.
            parameters: what calibration fits.
            causes: what may be wrong.
            tolerances: scatter from unit to unit.
            run_offsets: what differs from run to run.
            regimes: when the plant does what; None: no regimes.
            executor: simulates candidates side by side: processes for a simulator that can be pickled,
                threads for one that waits for another program; None: one after the other.
        """
        self.channels, self.runs = tuple(channels), tuple(runs)
        self.parameters, self.causes = tuple(parameters), tuple(causes)
        self.tolerances, self.run_offsets = tuple(tolerances), tuple(run_offsets)
        self.equations: Sequence[StateEquation] = ()
        self._simulation = _Simulation(simulate=simulate, channels=len(self.channels))
        self._regimes, self._executor = regimes, executor

    def outputs(self, values: Mapping[str, NDArray], runs: Sequence[int]) -> list[NDArray]:
        """`GreyBox.outputs`: (channels, samples, n) [SI] of each run."""
        n = max((len(value) for value in values.values()), default=1)
        candidates = [self._candidate(values, i, r) for r in runs for i in range(n)]
        recorded = [self.runs[r] for r in runs for _ in range(n)]
        side_by_side = self._executor.map if self._executor else map
        found = list(side_by_side(self._simulation, candidates, recorded))
        return [np.stack(found[k * n : (k + 1) * n], axis=2) for k in range(len(runs))]

    def states(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, StateTrace]:
        """`GreyBox.states`: inputs and model outputs, (samples,) [SI], as states are unknown."""
        outputs = self._first(values, run)
        inputs = {
            name: StateTrace(unit="SI", scale=1.0, values=np.asarray(signal, dtype=float))
            for name, signal in self.runs[run].inputs.items()
        }
        return inputs | {
            channel.name: StateTrace(unit=channel.unit, scale=channel.scale, values=readings)
            for channel, readings in zip(self.channels, outputs, strict=True)
        }

    def regimes(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, NDArray]:
        """`GreyBox.regimes`: boolean (samples,) by name, as the owner's function gives them."""
        return self._regimes(self.runs[run], self._first(values, run)) if self._regimes else {}

    def forced(
        self, values: Mapping[str, NDArray], equation: StateEquation, run: int, edges: NDArray
    ) -> NDArray:
        """`GreyBox.forced`, (channels, samples, windows): refused, as no equation is known.

        Raises:
            ValueError: always.
        """
        raise ValueError(
            f"equation {equation.name} cannot be forced: the equations of a black box are not known"
        )

    def _candidate(self, values: Mapping[str, NDArray], i: int, run: int) -> dict[str, float]:
        """Values of candidate i in a run, by symbol; nominal ones where none is given."""
        nuisances = [*self.tolerances, *self.run_offsets]
        nuisances += [n for cause in self.causes for n in cause.run_parameters]
        sizes = [p for cause in self.causes for p in cause.parameters]
        nominal = {n.symbol: n.centre for n in nuisances}
        nominal |= {p.symbol: p.nominal for p in (*sizes, *self.parameters)}
        given = {s: float(v[i, run] if np.ndim(v) == 2 else v[i]) for s, v in values.items()}
        return nominal | given

    def _first(self, values: Mapping[str, NDArray], run: int) -> NDArray:
        """Outputs (channels, samples) [SI] of the first candidate."""
        return self._simulation(self._candidate(values, 0, run), self.runs[run])


@dataclass(frozen=True, kw_only=True)
class _Simulation:
    """The simulator, whose failures are NaN and whose outputs have the right shape; can be pickled."""

    simulate: Simulate
    channels: int

    def __call__(self, values: Mapping[str, float], run: Run) -> NDArray:
        """Outputs (channels, samples) [SI] of one candidate; NaN where it cannot be simulated."""
        expected = self.channels, len(run.time)
        try:
            outputs = np.asarray(self.simulate(values, run), dtype=float)
        except ArithmeticError:
            return np.full(expected, np.nan)
        if outputs.shape != expected:
            raise ValueError(
                f"run {run.name}: the simulator returns the shape {outputs.shape}, not "
                f"(channels, samples) = {expected}: return a row for each channel"
            )
        return outputs
