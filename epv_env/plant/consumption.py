"""Air consumed from the circuit: brake applications, leaks and bursts, drawn from named scenarios.

A profile is a set of trapezoids in time (start, rise, hold, fall, height), so a brake application may
be a step or a ramp; the flow over a control period is the exact mean of the profile over it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

GRAM = 1e-3
APPLICATIONS = 128
"""Applications drawn per episode; one that outlasts them meets them again from the first."""

_SHORTEST_RAMP = 1e-4  # a step, as a ramp that cannot divide by zero [s]


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """How consumption is drawn for an episode. Ranges are uniform; flows in g/s, times in s."""

    meaning: str
    leak: tuple[float, float] = (0.0, 0.0)
    """Constant flow [g/s]."""
    flow: tuple[float, float] = (0.0, 0.0)
    """Flow of one application [g/s]."""
    pause: tuple[float, float] = (1.0, 3.0)
    """From the end of one application to the start of the next [s]."""
    rise: tuple[float, float] = (0.0, 0.0)
    hold: tuple[float, float] = (0.0, 0.0)
    fall: tuple[float, float] = (0.0, 0.0)
    first: tuple[float, float] = (0.6, 1.5)
    """Start of the first application [s]."""

    def draw(self, rng: np.random.Generator) -> "Profile":
        """One episode's consumption."""
        rise, hold, fall, pause, flow = (
            rng.uniform(*ends, size=APPLICATIONS)
            for ends in (self.rise, self.hold, self.fall, self.pause, self.flow)
        )
        lengths = rise + hold + fall + pause
        start = rng.uniform(*self.first) + np.cumsum(lengths) - lengths
        return Profile(
            leak=rng.uniform(*self.leak) * GRAM,
            applications=np.stack([start, rise, hold, fall, flow * GRAM]),
            span=float(np.sum(lengths)),
        )


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Consumption over time: a leak and a sequence of trapezoids. SI units."""

    leak: float
    applications: NDArray
    """Rows start, rise, hold, fall [s], flow [kg/s]; shape (5, APPLICATIONS), in order of time."""
    span: float
    """Time after which the sequence begins again [s]."""


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


def _ramped(time: NDArray, start: NDArray, width: NDArray) -> NDArray:
    """Integral up to `time` of a flow that rises from 0 to 1 over `width` from `start` [s]."""
    since = np.maximum(time - start, 0.0)
    width = np.maximum(width, _SHORTEST_RAMP)
    rising = np.minimum(since, width)
    return rising * rising / (2 * width) + np.maximum(since - width, 0.0)


def _passed(application: NDArray, begin: NDArray, end: NDArray) -> NDArray:
    """Air taken by one application per valve (5, n) between two times (n,) [kg]."""
    start, rise, hold, fall, flow = application
    release = start + rise + hold
    grown = _ramped(end, start, rise) - _ramped(begin, start, rise)
    faded = _ramped(end, release, fall) - _ramped(begin, release, fall)
    return flow * (grown - faded)


class Profiles:
    """The consumption of n episodes, read forward in time."""

    def __init__(self, n: int):
        self._leak = np.zeros(n)
        self._applications = np.zeros((5, APPLICATIONS, n))
        self._span = np.ones(n)
        self._now = np.zeros(n, dtype=np.int64)
        self._offset = np.zeros(n)
        self._all = np.arange(n)

    def start(self, i: int, profile: Profile) -> None:
        """Begin episode i with a profile at time 0."""
        self._leak[i] = profile.leak
        self._applications[:, :, i] = profile.applications
        self._span[i] = profile.span
        self._now[i] = 0
        self._offset[i] = 0.0

    def mean_flow(self, time: NDArray, period: float) -> NDArray:
        """Mean consumption over the period that starts at `time` (n,) [kg/s].

        Applications do not overlap, so at most the present one and the next can touch a period that
        is shorter than a pause.
        """
        begin = time - self._offset
        start, rise, hold, fall, _ = self._applications[:, self._now, self._all]
        self._now += begin >= start + rise + hold + np.maximum(fall, _SHORTEST_RAMP)
        wrapped = self._now == APPLICATIONS
        self._now[wrapped] = 0
        self._offset += self._span * wrapped
        begin = time - self._offset
        present = self._applications[:, self._now, self._all]
        following = self._applications[:, np.minimum(self._now + 1, APPLICATIONS - 1), self._all]
        taken = _passed(present, begin, begin + period)
        taken += np.where(self._now + 1 < APPLICATIONS, _passed(following, begin, begin + period), 0)
        return self._leak + taken / period
