"""Diagnoses of tanks, one for each verdict."""

from collections.abc import Callable
from functools import cache

import numpy as np

from docs.examples.tank import Tank, virtual_recordings
from identification.gap.diagnosis import Diagnosis, diagnose
from identification.gap.plant import Cause, FreeParameter


def leaking() -> Tank:
    """A cause of the catalogue."""
    return Tank(virtual_recordings({"c": 0.021, "leak": 4e-3}))


def without_gap() -> Tank:
    """Nothing that recalibration does not set right."""
    return Tank(virtual_recordings({"c": 0.021}))


def disturbed() -> Tank:
    """A disturbance that no cause of the catalogue makes."""
    tank = without_gap()
    for run in tank.runs:
        run.measured[:] += 0.02 * np.sin(run.time / 3.0)
    return tank


def struck() -> Tank:
    """A cause that the catalogue lacks."""
    tank = leaking()
    tank.causes = tuple(  # type: ignore[assignment]
        cause for cause in tank.causes if cause.name not in ("leak", "evaporation")
    )
    return tank


class Twins(Tank):
    """A leaking tank whose catalogue has the leak under two names."""

    def __init__(self):
        super().__init__(virtual_recordings({"c": 0.021, "leak": 4e-3}))
        parameter = FreeParameter(
            symbol="seep", unit="1/s", low=0.0, high=0.05, trials=(1e-3,), scale=1e-3
        )
        self.causes = (*self.causes, Cause(name="seep", component="tank", parameters=(parameter,)))

    def outputs(self, values, runs):
        """A seep is a leak."""
        both = values.get("leak", 0.0) + values.get("seep", np.zeros(1))
        return super().outputs({**values, "leak": both}, runs)


TANKS: dict[str, Callable[[], Tank]] = {
    "known": leaking,
    "no_gap": without_gap,
    "unknown": struck,
    "ambiguous": Twins,
}


@cache
def diagnosed(verdict: str) -> Diagnosis:
    """Of the tank that has this verdict."""
    return diagnose(TANKS[verdict]())
