"""Checks of a plant that is described by plain differential equations."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from identification.gap.model.cause import Cause
from identification.gap.model.free_parameter import FreeParameter, NuisanceParameter
from identification.gap.model.recorded_run import Channel, Run
from identification.gap.ode.records import TIME, Records


def checked_runs(runs: Sequence[Run], channels: Sequence[Channel]) -> tuple[Run, ...]:
    """The runs. Raises ValueError where inputs or channels differ from what the functions expect."""
    if not runs:
        raise ValueError("OdePlant.runs is empty: give at least one run to fit and one held out")
    wanted = tuple(runs[0].inputs)
    for run in runs:
        if tuple(run.inputs) != wanted:
            raise ValueError(
                f"run '{run.name}' has the inputs {list(run.inputs)}, and '{runs[0].name}' has "
                f"{list(wanted)}: give every run the same inputs in the same order"
            )
        if len(run.measured) != len(channels):
            raise ValueError(
                f"run '{run.name}' has {len(run.measured)} rows of readings for {len(channels)} "
                "channels: give one row per channel"
            )
    return tuple(runs)


def nominal_values(
    parameters: Sequence[FreeParameter],
    causes: Sequence[Cause],
    nuisances: Sequence[NuisanceParameter],
) -> dict[str, float]:
    """Value of every symbol in the nominal model [SI]. Raises ValueError where two claims differ."""
    free = [*parameters, *(p for cause in causes for p in cause.parameters)]
    own = [*nuisances, *(p for cause in causes for p in cause.run_parameters)]
    claims = [(p.symbol, p.nominal) for p in free] + [(p.symbol, p.centre) for p in own]
    values: dict[str, float] = {}
    for symbol, value in claims:
        if values.setdefault(symbol, value) != value:
            raise ValueError(
                f"symbol '{symbol}' has the nominal values {values[symbol]:g} and {value:g}: give it "
                "one value, or two symbols"
            )
    return values


def checked_names(records: Records, given: Mapping[str, Mapping[str, Any] | None]) -> None:
    """Raises ValueError where a member by state has a name that is no state."""
    for member, by_state in given.items():
        for name in by_state or {}:
            if name not in records.states:
                raise ValueError(
                    f"{member} has '{name}', which is none of the states {list(records.states)}: "
                    "correct the name"
                )


def probe(
    plant: Any,
    records: Records,
    rate: Callable,
    readings: Callable,
    thresholds: Callable | None,
    delays: Mapping[str, str],
) -> int:
    """Number of thresholds. Raises ValueError where a function's results or a name do not fit."""
    if TIME in records.inputs:
        raise ValueError(f"input '{TIME}' has the name of the time in seconds: rename the input")
    for name, symbol in delays.items():
        if name not in records.inputs or symbol not in records.symbols:
            raise ValueError(
                f"delays: '{name}': '{symbol}' is no pair of an input {list(records.inputs)} and a "
                f"symbol {list(records.symbols)}: correct the names"
            )
    run = plant.runs[0]
    p = records.p(*plant.nominal.values())
    u = records.u(0.0, *(float(signal[0]) for signal in run.inputs.values()))
    begun = _counted("start", plant._start(run, p), len(records.states), "state")
    x = records.x(*(float(value) for value in begun))
    _counted("rate", rate(x, u, p), len(records.states), "state")
    _counted("readings", readings(x, u, p), len(plant.channels), "channel")
    return len(thresholds(x, u, p)) if thresholds else 0


def _counted(name: str, results: Any, count: int, kind: str) -> Any:
    if not hasattr(results, "__len__") or len(results) != count:
        found = len(results) if hasattr(results, "__len__") else "a number instead of"
        raise ValueError(
            f"OdePlant: {name} gives {found} results for {count} {kind}(s): return a tuple with one "
            f"value per {kind}, as in `return (first,)`"
        )
    return results
