"""Contenders of a comparison, and how many episodes each of them runs."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from controllers.base import Controller, Privileged
from controllers.p3_check import P3Check
from controllers.registry import REGISTRY, cost_class
from controllers.supervisor import Supervisor
from epv_env.conditions import Conditions
from training.evaluation.metrics import EpisodeMetrics
from training.evaluation.scenarios import RANDOM, TUNING_REGION

BOUNDED = ("confidence", "sensitive_ten_percent")
"""Plant sets on which the violation rate is bounded: many random episodes."""

TRADE_OFF_ON = "sensitive_ten_percent"
"""Plant set on which switching is set against excursion."""

CRITERIA_ON = "calibrated"
"""Plant set on which figures are set against each rival's at equal or fewer switchings."""

TUNING = "tuning"
"""Scenarios on which one of the training seeds is chosen, with seeds of the tuning."""

TUNING_CONDITIONS = Conditions(
    extreme=0.5, braking=0.5, coil_off=0.2, starved=0.1, target_steps=0.3
)  # fmt: skip
"""Under which they run: a good policy leaves the band so rarely in ordinary episodes that a choice among
several would be chance."""


class Expense(NamedTuple):
    """Computing cost of a controller, and how many fewer episodes it runs for that reason."""

    times: int
    """CPU time of an episode, in those of the others (measured, 512 side by side against 16)."""
    fewer: int
    """How many times fewer episodes it runs: the first of the others', so that the pairing holds."""
    random: int
    """But of the random scenario at least so many where figures are set against each other (CRITERIA_ON,
    TRADE_OFF_ON), if the others run as many."""

    def episodes(self, plants: str, scenario: str, wanted: int) -> int:
        """Episodes that it runs where the other controllers run `wanted`."""
        least = self.random if scenario == RANDOM and plants in (CRITERIA_ON, TRADE_OFF_ON) else 0
        return max(-(-wanted // self.fewer), min(wanted, least))


EXPENSIVE = {
    entry.kind: Expense(
        times=entry.cost.relative_cpu_time,
        fewer=entry.cost.episode_divisor,
        random=entry.cost.paired_random_episodes,
    )
    for entry in REGISTRY
}
"""By contender, as its cost class in the registry says."""

CHEAP = Expense(times=1, fewer=1, random=0)


@dataclass(frozen=True, kw_only=True)
class Sizes:
    """Episodes of one run of a contender."""

    named: int
    """Episodes in each named scenario and plant set."""
    random: int
    """Episodes in the random scenario on the calibrated plant, and of a variant in the trade-off."""
    bound: int
    """Episodes in the random scenario on each plant set of BOUNDED."""
    tuning: int
    """Episodes on the tuning scenarios, to choose a training seed."""

    def of(self, plants: str, scenario: str) -> int:
        """Episodes in a scenario and plant set; 0: left out."""
        if scenario == RANDOM:
            return self.bound if plants in BOUNDED else self.random
        return 0 if plants == "confidence" else self.named


@dataclass(frozen=True, kw_only=True)
class Contender:
    """A row of the tables: one controller, or one per training seed."""

    name: str
    runs: Mapping[str, Controller]
    """Its controllers, by names of their own: one of a classic, one per training seed of a learned."""
    learned: bool = False
    """Whether its runs differ by the seed of a training."""
    price: float | None = None
    """Of a switching, for a variant that was optimised at it and takes part in the trade-off only."""

    @property
    def privileged(self) -> bool:
        """Whether it uses privileged information, which no ECU can measure: a limit, not a rival."""
        return isinstance(next(iter(self.runs.values())), Privileged)

    @property
    def supervised(self) -> bool:
        """Whether its runs are policies under a supervisor."""
        first = next(iter(self.runs.values()))
        return isinstance(first, P3Check) and isinstance(first.main, Supervisor)

    @property
    def model_based(self) -> bool:
        """Whether it simulates the plant as it runs."""
        return cost_class(self.name).simulates_plant


Results = dict[tuple[str, str, str], EpisodeMetrics]
"""Episodes by run, plant set and scenario."""


def chosen_run(contender: Contender, results: Results) -> str:
    """Its run that leaves the band least often on the tuning scenarios; evaluations play no part in it.

    The return decides between equals.
    """
    if len(contender.runs) == 1:
        return next(iter(contender.runs))

    def merit(run: str) -> tuple[float, float]:
        metrics = results[run, TUNING_REGION, TUNING]
        return float(metrics.stayed.mean()), float(metrics.episode_return.mean())

    return max(contender.runs, key=merit)
