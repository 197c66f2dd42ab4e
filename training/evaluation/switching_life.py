"""How long the coil's valve lasts at a stated duty, from how often a controller switches it."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Duty:
    """How much a valve works, and how many cycles it stands."""

    hours_per_year: float = 2000.0
    """Time in which the vehicle is driven [h]: a year of one shift."""
    braking: float = 0.1
    """Share of this time with service braking [1]; in the rest of it nothing is drawn."""
    rated_cycles: float = 20e6
    """Cycles after which a tenth of the valves has failed dangerously [1]: B10D of pneumatic components,
    ISO 13849-1:2015, Table C.1. A cycle is one switching on and one off."""


DUTY = Duty()


def life_years(*, at_rest: float, in_service: float, duty: Duty = DUTY) -> float:
    """Time until the rated cycles are used up [years]; infinite for a valve that never switches.

    at_rest, in_service: switchings per second while nothing is drawn, and during service braking [1/s].
    """
    switchings = (1 - duty.braking) * at_rest + duty.braking * in_service
    cycles_per_year = switchings / 2 * 3600 * duty.hours_per_year
    return duty.rated_cycles / cycles_per_year if cycles_per_year > 0 else float("inf")
