"""The simulator of a plant's functions: with numbers, with arrays, or compiled."""

from collections.abc import Callable, Sequence

from identification.gap.ode.records import Records, compiled
from identification.gap.ode.settings import OdeSettings
from identification.gap.ode.simulation import alone, together
from identification.gap.ode.stepping import stepping

MODES = ("numpy", "python", "compiled")


def simulator(
    records: Records, functions: Sequence[tuple[Callable, int]], mode: str, settings: OdeSettings
) -> Callable:
    """A function of a `Job` that gives readings and states.

    Args:
        records: the plant's names.
        functions: rate, readings and thresholds of records, each with its number of results.
        mode: one of MODES.
        settings: accuracy.

    Raises:
        ValueError: for another mode.
    """
    if mode not in MODES:
        raise ValueError(f"mode '{mode}' is none of {', '.join(MODES)}: choose one of them")
    (_, channels), (_, count) = functions[1:]
    if mode == "compiled":
        flat = [compiled(records.flat(compiled(f), results)) for f, results in functions]
    else:
        flat = [records.flat(f, results) for f, results in functions]
    rate, read, thresholds = flat
    wrap = compiled if mode == "compiled" else (lambda function: function)
    steps = stepping(rate, thresholds, count, settings, wrap)
    if mode == "numpy":
        return together(steps, read, channels, count)
    return alone(steps, read, channels, compile_loop=mode == "compiled")
