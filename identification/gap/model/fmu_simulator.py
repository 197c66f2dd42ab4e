"""Simulation of an FMU (Functional Mock-up Unit, fmi-standard.org) through FMPy, an optional package."""

import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.common.extras import how_to_install
from identification.gap.model.recorded_run import Run

StartValues = Callable[[Run], Mapping[str, float]]
"""Start values of a run, such as initial states, by variable of the FMU, in the FMU's units."""


@dataclass(frozen=True, kw_only=True)
class FmuSimulator:
    """Simulator of one candidate for `BlackBoxPlant`; can be pickled for a pool of processes.

    Keep to processes: FMPy changes the working directory, which threads share.
    """

    path: Path
    inputs: Mapping[str, str]
    outputs: Sequence[str]
    parameters: Mapping[str, str]
    start_values: StartValues | None

    def __call__(self, values: Mapping[str, float], run: Run) -> NDArray:
        """Outputs (channels, samples) of the FMU at the run's instants, in the FMU's units.

        values: by symbol [SI]. run: its inputs drive the FMU. Raises ArithmeticError where the FMU stops
        before the end.
        """
        unpacked = _unpacked(self.path)
        start = dict(self.start_values(run)) if self.start_values else {}
        start |= {variable: values[symbol] for symbol, variable in self.parameters.items()}
        signals = self._signals(run)
        try:
            found = unpacked.fmpy.simulate_fmu(
                unpacked.folder.name,
                model_description=unpacked.description,
                start_time=float(run.time[0]),
                stop_time=float(run.time[-1]),
                output_interval=float(run.time[-1] - run.time[0]) / (len(run.time) - 1),
                start_values=start,
                input=signals,
                output=list(self.outputs),
            )
        except (unpacked.call_failed, RuntimeError) as error:  # of the FMU, of the solver CVode
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


def fmu_simulator(
    path: Path | str,
    inputs: Mapping[str, str],
    outputs: Sequence[str],
    parameters: Mapping[str, str],
    start_values: StartValues | None = None,
) -> FmuSimulator:
    """A simulator for `BlackBoxPlant` from an FMU for co-simulation or model exchange (FMI 1 to 3).

    Signals between two samples of an input lie on a straight line. A symbol that the FMU does not have,
    such as the lag of a sensor, is left to a function around this one.

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
    path = Path(path).resolve()
    known = {variable.name for variable in _unpacked(path).description.modelVariables}
    missing = [name for name in (*inputs.values(), *outputs, *parameters.values()) if name not in known]
    if missing:
        raise ValueError(
            f"{path}: the FMU has no variable {', '.join(missing)}: take names from its "
            "modelDescription.xml"
        )
    return FmuSimulator(
        path=path, inputs=inputs, outputs=outputs, parameters=parameters, start_values=start_values
    )


@dataclass(frozen=True, kw_only=True)
class _Unpacked:
    """An FMU on disk. FMPy has no type information."""

    fmpy: Any
    call_failed: type[Exception]
    """What FMPy raises where a function of the FMU reports an error."""
    folder: TemporaryDirectory
    """Removed with this record, when the process ends."""
    description: Any


@cache
def _unpacked(path: Path) -> _Unpacked:
    """The FMU, unpacked once per process into a temporary folder."""
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
    return _Unpacked(fmpy=fmpy, call_failed=call_failed, folder=folder, description=description)
