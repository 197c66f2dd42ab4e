"""The simulator of a plant's functions: with numbers, with arrays, or compiled."""

from collections.abc import Callable, Sequence

from numba.core.errors import NumbaError

from identification.gap.ode.records import Records, compiled
from identification.gap.ode.settings import OdeSettings
from identification.gap.ode.side_by_side import together
from identification.gap.ode.simulation import Job, Simulation, alone
from identification.gap.ode.stepping import advancing

MODES = ("numpy", "python", "compiled")


def simulator(
    records: Records, functions: Sequence[tuple[Callable, int]], mode: str, settings: OdeSettings
) -> Simulation:
    """The simulation of a plant.

    Args:
        records: the plant's names.
        functions: rate, readings and thresholds of records, each with its number of results.
        mode: one of MODES.
        settings: accuracy.

    Raises:
        ValueError: for another mode, and at the first simulation for functions that numba refuses.
    """
    if mode not in MODES:
        raise ValueError(f"mode '{mode}' is none of {', '.join(MODES)}: choose one of them")
    own = compiled if mode == "compiled" else _as_it_is
    rate, read, thresholds = (own(records.flat(own(f), results)) for f, results in functions)
    channels, count = functions[1][1], functions[2][1]
    advance = advancing(rate, thresholds, count, settings, own)
    if mode == "numpy":
        return together(rate, read, thresholds, (channels, count), advance)
    simulation = alone(advance, read, channels, own)
    return _explained(simulation) if mode == "compiled" else simulation


def _explained(simulation: Simulation) -> Simulation:
    """The simulation, whose refusal by numba becomes one sentence."""

    def simulate(jobs: Sequence[Job]):
        try:
            return simulation(jobs)
        except NumbaError as error:
            lines = [line for line in str(error).splitlines() if "File" not in line and line.strip()]
            reason = next((line for line in lines if "Failed in" not in line), lines[0])
            raise ValueError(
                f"rate, readings or thresholds cannot be compiled by numba ({reason}): let them use "
                "numbers, numpy and functions under numba.njit only, or choose mode='numpy'"
            ) from error

    return simulate


def _as_it_is(function: Callable) -> Callable:
    return function
