"""Consumptions that may follow: other draws of the same scenario that agree with what has happened.

The draws know which scenario an episode has, and the course of the application under way up to now.
When that application ends and when the next ones come is drawn anew.
"""

import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import GRAM
from epv_env.plant.consumption import APPLICATIONS, PROGRESS, SCENARIOS, Scenario, totals

NEXT = 8
"""Applications that are drawn ahead: more than any scenario has in half a second."""
NEVER = 1e9
"""Start of the applications beyond them [s]."""


def scenario_of(record: np.void) -> Scenario:
    """The named scenario that an episode's profile, a record of PROGRESS, was drawn from.

    Raises ValueError if it is none of SCENARIOS.
    """
    _, rise, hold, fall, flow = record["applications"].T
    found = {
        "rise": rise,
        "hold": hold,
        "fall": fall,
        "flow": flow / GRAM,
        "leak": record["leak"] / GRAM,
    }
    for scenario in SCENARIOS.values():
        ranges = {name: getattr(scenario, name) for name in found}
        if all(
            np.all((low - 1e-9 <= found[name]) & (found[name] <= high + 1e-9))
            for name, (low, high) in ranges.items()
        ):
            return scenario
    raise ValueError("the consumption is none of the named scenarios: leave the causal bound out")


def likely_flows(
    record: np.void,
    scenario: Scenario,
    *,
    time: float,
    period: float,
    periods: int,
    draws: int,
    rng: np.random.Generator,
) -> NDArray:
    """Mean flows of the coming control periods, (draws, periods) [kg/s].

    Args:
        record: of PROGRESS, the episode's.
        scenario: that it was drawn from.
        time: now, since the episode's start [s].
        period: control period [s].
        periods: how many are drawn.
        draws: number of draws.
        rng: of the draws.
    """
    futures = np.zeros(draws, dtype=PROGRESS)
    futures["leak"] = record["leak"]
    futures["applications"][:, :, 0] = NEVER
    futures["applications"][:, :NEXT] = _applications(record, scenario, time, draws, rng)
    taken = totals(futures, time + np.arange(periods + 1) * period)
    return np.diff(taken, axis=1) / period


def _applications(
    record: np.void, scenario: Scenario, time: float, draws: int, rng: np.random.Generator
) -> NDArray:
    """The application under way or else the next one, and those after it, (draws, NEXT, 5)."""
    shape = (draws, NEXT)
    rise, hold, fall, pause, flow = (
        rng.uniform(low, high, shape)
        for low, high in (scenario.rise, scenario.hold, scenario.fall, scenario.pause, scenario.flow)
    )
    flow *= GRAM
    now, offset = int(record["now"]), float(record["offset"])
    own = record["applications"][min(now, APPLICATIONS - 1)]
    start = offset + own[0]
    if time >= start:  # it is under way: what has been seen of it stays
        rise[:, 0], flow[:, 0] = own[1], own[4]
        held = time - start - own[1]
        if held > own[2]:
            hold[:, 0], fall[:, 0] = own[2], own[3]
        else:
            hold[:, 0] = rng.uniform(
                max(scenario.hold[0], min(held, scenario.hold[1])), scenario.hold[1], draws
            )
        first = np.full(draws, start)
    elif now == 0 and offset == 0.0:
        first = rng.uniform(
            max(scenario.first[0], min(time, scenario.first[1])), scenario.first[1], draws
        )
    else:
        last = record["applications"][now - 1]
        ended = offset + last[:4].sum() if now else offset
        waited = min(time - ended, scenario.pause[1])
        first = ended + rng.uniform(max(scenario.pause[0], waited), scenario.pause[1], draws)
    lengths = rise + hold + fall + pause
    starts = first[:, None] + np.cumsum(lengths, axis=1) - lengths
    return np.stack([starts, rise, hold, fall, flow], axis=2)
