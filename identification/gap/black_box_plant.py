"""A plant whose simulator is a black box: a function of one candidate, or an FMU.

An FMU (Functional Mock-up Unit, fmi-standard.org) is simulated through FMPy, an optional package.
"""

import importlib
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from copy import copy
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.common.extras import how_to_install
from identification.gap.plant import (
    Cause,
    Channel,
    FreeParameter,
    NuisanceParameter,
    Run,
    StateEquation,
    StateTrace,
)

Simulate = Callable[[Mapping[str, float], Run], NDArray]
"""Simulator of one candidate: (values of all symbols [SI], run) to outputs (channels, samples) [SI].

It raises ArithmeticError where a candidate cannot be simulated.
"""


class BlackBoxPlant:
    """`GreyBox` around a function that simulates one candidate at a time.

    Nothing is known of states and equations: a gap is located by channel and reading, and drawn over
    inputs and outputs, but in no equation and no regime.
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
            executor: simulates candidates side by side: processes for a simulator that can be pickled,
                threads for one that waits for another program; None: one after the other.
        """
        self.channels, self.runs = tuple(channels), tuple(runs)
        self.parameters, self.causes = tuple(parameters), tuple(causes)
        self.tolerances, self.run_offsets = tuple(tolerances), tuple(run_offsets)
        self.equations: Sequence[StateEquation] = ()
        self._simulation = _Simulation(simulate=simulate, channels=len(self.channels))
        self._executor = executor

    def with_runs(self, runs: Sequence[Run]) -> "BlackBoxPlant":
        """The plant with other readings and inputs of its runs; nothing else of them changes."""
        other = copy(self)
        other.runs = tuple(runs)
        return other

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
        outputs = self._simulation(self._candidate(values, 0, run), self.runs[run])
        inputs = {
            name: StateTrace(unit="SI", scale=1.0, values=np.asarray(signal, dtype=float))
            for name, signal in self.runs[run].inputs.items()
        }
        return inputs | {
            channel.name: StateTrace(unit=channel.unit, scale=channel.scale, values=readings)
            for channel, readings in zip(self.channels, outputs, strict=True)
        }

    def regimes(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, NDArray]:
        """`GreyBox.regimes`: none."""
        return {}

    def forced(self, values: Mapping[str, NDArray], run: int, forcing: Mapping[str, NDArray]) -> NDArray:
        """`GreyBox.forced`, (channels, samples, m): refused, as no equation is known.

        Raises:
            ValueError: always.
        """
        raise ValueError(
            f"{', '.join(forcing)} cannot be forced: the equations of a black box are not known"
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


StartValues = Callable[[Run], Mapping[str, float]]
"""Start values of a run, such as initial states, by variable of the FMU, in the FMU's units."""


class FmuSimulator:
    """Simulator of one candidate for `BlackBoxPlant`, from an FMU for co-simulation or model exchange.

    FMI 1 to 3. Signals between two samples of an input lie on a straight line. A symbol that the FMU
    lacks, such as the lag of a sensor, is left to a function around this one. It can be pickled for a
    pool of processes; keep to processes, as FMPy changes the working directory, which threads share.
    """

    def __init__(
        self,
        path: Path | str,
        inputs: Mapping[str, str],
        outputs: Sequence[str],
        parameters: Mapping[str, str],
        start_values: StartValues | None = None,
    ):
        """Read the FMU.

        Args:
            path: the FMU.
            inputs: variable of the FMU by name of an input in `Run.inputs`.
            outputs: variables of the FMU, one for each channel, in SI.
            parameters: variable of the FMU by symbol of a parameter, cause or nuisance, in SI.
            start_values: further start values of each run; None: none.

        Raises:
            ImportError: FMPy is not installed.
            ValueError: the FMU cannot be read, or lacks a variable.
        """
        self.path = Path(path).resolve()
        self.inputs, self.outputs, self.parameters = inputs, outputs, parameters
        self.start_values = start_values
        _, _, _, description = _unpacked(self.path)
        known = {variable.name for variable in description.modelVariables}
        named = (*inputs.values(), *outputs, *parameters.values())
        missing = [name for name in named if name not in known]
        if missing:
            raise ValueError(
                f"{self.path}: the FMU has no variable {', '.join(missing)}: take names from its "
                "modelDescription.xml"
            )

    def __call__(self, values: Mapping[str, float], run: Run) -> NDArray:
        """Outputs (channels, samples) of the FMU at the run's instants, in the FMU's units.

        values: by symbol [SI]. run: its inputs drive the FMU. Raises ArithmeticError where the FMU stops
        before the end.
        """
        fmpy, call_failed, folder, description = _unpacked(self.path)
        start = dict(self.start_values(run)) if self.start_values else {}
        start |= {variable: values[symbol] for symbol, variable in self.parameters.items()}
        signals = self._signals(run)
        try:
            found = fmpy.simulate_fmu(
                folder.name,
                model_description=description,
                start_time=float(run.time[0]),
                stop_time=float(run.time[-1]),
                output_interval=float(run.time[-1] - run.time[0]) / (len(run.time) - 1),
                start_values=start,
                input=signals,
                output=list(self.outputs),
            )
        except (call_failed, RuntimeError) as error:  # of the FMU, of the solver CVode
            raise ArithmeticError(f"{self.path}: {error}") from error
        if found["time"][-1] < 0.5 * (run.time[-2] + run.time[-1]):
            raise ArithmeticError(f"{self.path}: the FMU stopped at {found['time'][-1]:g} s")
        return np.array([np.interp(run.time, found["time"], found[name]) for name in self.outputs])

    def _signals(self, run: Run) -> NDArray | None:
        """Inputs as FMPy takes them: a structured array (samples,)."""
        if not self.inputs:
            return None
        kinds = [("time", float), *((variable, float) for variable in self.inputs.values())]
        signals = np.zeros(len(run.time), dtype=kinds)
        signals["time"] = run.time
        for name, variable in self.inputs.items():
            signals[variable] = run.inputs[name]
        return signals


@cache
def _unpacked(path: Path) -> tuple[Any, type[Exception], TemporaryDirectory, Any]:
    """FMPy, what it raises where a function of the FMU fails, the FMU's folder and its description.

    Unpacked once per process; the folder is removed when the process ends. FMPy has no types.
    """
    try:
        fmpy = importlib.import_module("fmpy")
        call_failed = importlib.import_module("fmpy.fmi1").FMICallException
    except ImportError:
        raise ImportError(
            f"an FMU needs FMPy, which is not installed: {how_to_install('fmu')}"
        ) from None
    folder = TemporaryDirectory(prefix="fmu-", ignore_cleanup_errors=True)
    try:
        fmpy.extract(str(path), folder.name)
        description = fmpy.read_model_description(folder.name)
    except Exception as error:  # FMPy raises bare exceptions
        raise ValueError(f"{path} cannot be read as an FMU: {error}: export it again") from error
    return fmpy, call_failed, folder, description
