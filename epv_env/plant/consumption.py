"""Air consumed from the circuit: brake applications, leaks and bursts, drawn from named scenarios.

A profile is a set of trapezoids in time (start, rise, hold, fall, height), so a brake application may
be a step or a ramp; the flow over a control period is the exact mean of the profile over it.
"""

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from epv_env.common.field_types import check_fields
from epv_env.common.units import GRAM
from epv_env.plant.primitives import exact

APPLICATIONS = 128
"""Applications drawn per episode; one that outlasts them meets them again from the first."""

_SHORTEST_RAMP = 1e-4  # a step, as a ramp that cannot divide by zero [s]


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """How consumption is drawn for an episode. Ranges are uniform; flows in g/s, times in s."""

    meaning: str
    """What the consumers do, in a line for tables."""
    leak: tuple[float, float] = (0.0, 0.0)
    """Constant flow [g/s]."""
    flow: tuple[float, float] = (0.0, 0.0)
    """Flow of one application [g/s]."""
    pause: tuple[float, float] = (1.0, 3.0)
    """From the end of one application to the start of the next [s]."""
    rise: tuple[float, float] = (0.0, 0.0)
    """Time in which the flow of an application rises [s]."""
    hold: tuple[float, float] = (0.0, 0.0)
    """Time for which it stays at its height [s]."""
    fall: tuple[float, float] = (0.0, 0.0)
    """Time in which it falls to zero [s]."""
    first: tuple[float, float] = (0.6, 1.5)
    """Start of the first application [s]."""

    def __post_init__(self) -> None:
        check_fields(self)
        for entry in fields(self)[1:]:
            low, high = getattr(self, entry.name)
            if not 0 <= low <= high < np.inf:
                raise ValueError(
                    f"scenario: {entry.name} = ({low:g}, {high:g}) must satisfy 0 <= low <= high: "
                    "consumers draw air, and time does not run back"
                )

    def draw(self, rng: np.random.Generator) -> "Profile":
        """One episode's consumption."""
        low, high = self._ends
        rise, hold, fall, pause, flow = low + (high - low) * rng.random((5, APPLICATIONS))
        lengths = rise + hold + fall + pause
        start = rng.uniform(*self.first) + np.cumsum(lengths) - lengths
        return Profile(
            leak=rng.uniform(*self.leak) * GRAM,
            applications=np.stack([start, rise, hold, fall, flow * GRAM]),
            span=float(np.sum(lengths)),
        )

    @cached_property
    def _ends(self) -> NDArray:
        """Lower and upper ends of rise, hold, fall, pause and flow, (2, 5, 1)."""
        return np.transpose([self.rise, self.hold, self.fall, self.pause, self.flow])[..., None]


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Consumption over time: a leak and a sequence of trapezoids. SI units."""

    leak: float
    """Constant flow [kg/s]."""
    applications: NDArray
    """Rows start, rise, hold, fall [s], flow [kg/s]; shape (5, APPLICATIONS), in order of time."""
    span: float
    """Time after which the sequence begins again [s]."""

    def later(self, seconds: float) -> "Profile":
        """The same with all applications later; the leak stays."""
        shift = np.array([seconds, 0.0, 0.0, 0.0, 0.0])[:, None]
        return replace(self, applications=self.applications + shift)


SILENT = Profile(leak=0.0, applications=np.zeros((5, APPLICATIONS)), span=1.0)
"""No consumption."""

SCENARIOS: dict[str, Scenario] = {
    "none": Scenario(meaning="no consumption at all"),
    "leak": Scenario(meaning="a steady leak", leak=(0.1, 0.8)),
    "service": Scenario(
        meaning="service braking: moderate ramps every few seconds, small leak",
        leak=(0.0, 0.1), flow=(1.0, 3.5), rise=(0.1, 0.4), hold=(0.2, 1.0), fall=(0.1, 0.4),
    ),
    "steps": Scenario(
        meaning="sudden brake applications of a few g/s",
        leak=(0.0, 0.1), flow=(1.5, 5.0), hold=(0.3, 1.2), pause=(0.6, 2.0),
    ),
    "emergency": Scenario(
        meaning="one long, hard application at a time",
        flow=(4.0, 5.5), rise=(0.02, 0.05), hold=(1.0, 2.0), fall=(0.05, 0.1), pause=(1.5, 3.0),
    ),
    "pumping": Scenario(
        meaning="repeated short bursts, as of an anti-lock system",
        flow=(2.5, 5.0), hold=(0.05, 0.12), pause=(0.08, 0.2),
    ),
    "creeping": Scenario(
        meaning="slowly growing and fading consumption",
        flow=(1.0, 3.0), rise=(1.0, 2.0), hold=(0.2, 0.5), fall=(1.0, 2.0), pause=(0.2, 0.8),
    ),
}  # fmt: skip
"""Named scenarios. "mixed" draws one of them for every episode."""

MIXED = "mixed"


def check_scenario(scenario: str | Scenario) -> str | Scenario:
    """The scenario, if it is a Scenario, the name of one of SCENARIOS, or "mixed"; else ValueError."""
    known = [MIXED, *SCENARIOS]
    if isinstance(scenario, Scenario) or (isinstance(scenario, str) and scenario in known):
        return scenario
    raise ValueError(
        f"unknown consumption scenario {scenario!r}: choose one of {', '.join(known)}, "
        "or give a Scenario"
    )


def draw_profile(scenario: str | Scenario, rng: np.random.Generator) -> Profile:
    """One episode's consumption from a scenario, or from that of this name (or "mixed")."""
    if isinstance(scenario, Scenario):
        return scenario.draw(rng)
    if scenario == MIXED:
        scenario = list(SCENARIOS)[rng.integers(len(SCENARIOS))]
    return SCENARIOS[scenario].draw(rng)


PROGRESS = np.dtype((np.record, np.dtype(
    [
        ("leak", np.float64),
        ("applications", np.float64, (APPLICATIONS, 5)),
        ("span", np.float64),
        ("now", np.int64),
        ("offset", np.float64),
    ],
    align=True,
)))  # fmt: skip
"""A profile and how far it has been read: leak [kg/s], applications, length of their sequence [s],
number of the application under way, or else of the next one, and when the sequence began last [s]."""


@exact
def _ramped(time: float, start: float, width: float) -> float:
    """Integral up to `time` of a flow that rises from 0 to 1 over `width` from `start` [s]."""
    since = max(time - start, 0.0)
    width = max(width, _SHORTEST_RAMP)
    rising = min(since, width)
    return rising * rising / (2 * width) + max(since - width, 0.0)


@exact
def _passed(application: NDArray, begin: float, end: float) -> float:
    """Air taken by an application (5,) between two times [kg]."""
    start, rise, hold, fall, flow = application
    if end <= start:
        return 0.0
    release = start + rise + hold
    grown = _ramped(end, start, rise) - _ramped(begin, start, rise)
    faded = _ramped(end, release, fall) - _ramped(begin, release, fall)
    return flow * (grown - faded)


@exact
def mean_flow(p: Any, time: float, period: float) -> float:
    """Mean consumption of one episode over the period that starts at `time` [kg/s].

    p: a record of PROGRESS, which is read on as far as `time`. Applications do not overlap, so at most
    the present one and the next can touch a period that is shorter than a pause.
    """
    start, rise, hold, fall, _ = p.applications[p.now]
    if time - p.offset >= start + rise + hold + max(fall, _SHORTEST_RAMP):
        p.now += 1
    if p.now == APPLICATIONS:
        p.now = 0
        p.offset += p.span
    begin = time - p.offset
    taken = 0.0
    for k in range(p.now, min(p.now + 2, APPLICATIONS)):
        taken += _passed(p.applications[k], begin, begin + period)
    return p.leak + taken / period


@numba.njit(cache=True)
def _mean_flows(progress: NDArray, time: NDArray, period: float) -> NDArray:
    """`mean_flow` of each episode, (n,) [kg/s]; progress (n,) of PROGRESS, time (n,) [s]."""
    flows = np.empty(len(time))
    for i in range(len(time)):
        flows[i] = mean_flow(progress[i], time[i], period)
    return flows


class Profiles:
    """The consumption of n episodes, read forward in time."""

    def __init__(self, n: int):
        self.progress = np.zeros(n, dtype=PROGRESS)
        """A record of PROGRESS for each episode, (n,)."""

    def start(self, i: int, profile: Profile) -> None:
        """Begin episode i with a profile at time 0."""
        self.progress[i] = (profile.leak, profile.applications.T, profile.span, 0, 0.0)

    def mean_flow(self, time: NDArray, period: float) -> NDArray:
        """Mean consumption over the period that starts at `time` (n,) [kg/s]."""
        return _mean_flows(self.progress, time, period)
