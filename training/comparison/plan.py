"""Who is compared on what: contenders, and the blocks of episodes that each of them runs."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, NamedTuple

import joblib
import numpy as np
from numpy.typing import NDArray

from controllers.base import Controller, Privileged
from training.evaluate import PLANTS, plant_region
from training.metrics import EpisodeMetrics
from training.scenarios import EVALUATION, RANDOM
from training.seeds import EVALUATION_SEED, TUNING_SEED
from training.sweeps.tasks import Study
from training.tune import TUNING_REGION

BOUNDED = ("confidence", "sensitive_ten_percent")
"""Plant sets on which the probability of leaving the band is bounded: many random episodes."""

TRADED_ON = "sensitive_ten_percent"
"""Plant set on which switching is set against excursion."""

BARS_ON = "calibrated"
"""Plant set on which figures are set against each rival's at equal or fewer switchings."""

LARGEST_BATCH = 512
"""Episodes side by side; larger batches are hardly faster, smaller ones resume in finer steps."""

TUNING = "tuning"
"""The scenarios of the tuning, on which one of the training seeds is chosen."""


class Expense(NamedTuple):
    """What a controller costs that searches on the plant's simulation."""

    times: int
    """CPU time of an episode, in those of the others (measured, 512 side by side against 16)."""
    fewer: int
    """How many times fewer episodes it runs: the first of the others', so that the pairing holds."""


EXPENSIVE = {
    "MPC": Expense(times=200, fewer=32),
    "oracle": Expense(times=200, fewer=32),
    "pulse, informed": Expense(times=30, fewer=8),
}
"""By contender. The informed pulse's is the table of each plant."""

CHEAP = Expense(times=1, fewer=1)


@dataclass(frozen=True, kw_only=True)
class Sizes:
    """Episodes of one run of a contender."""

    named: int
    """In each named scenario and plant set."""
    random: int
    """In the random scenario on the calibrated plant, and of a variant in the trade-off."""
    bound: int
    """In the random scenario on each plant set of BOUNDED."""
    tuning: int
    """On the tuning scenarios, to choose a training seed."""

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
        """Whether it is told what no ECU can measure: a limit, not a rival."""
        return isinstance(next(iter(self.runs.values())), Privileged)

    @property
    def model_based(self) -> bool:
        """Whether it simulates the plant as it runs."""
        return "MPC" in self.name


def fingerprint(controller: Controller) -> str:
    """Changes with the controller's settings or weights."""
    return str(joblib.hash(controller))[:12]


@dataclass(frozen=True, kw_only=True)
class Block:
    """Episodes side by side of one controller in one scenario and plant set."""

    run_name: str
    """Which of the study's controllers."""
    version: str
    """Its fingerprint: what an earlier version found is not taken for this one's."""
    plants: str
    scenario: str
    first_seed: int
    count: int
    cost: int = 1
    """Of an episode, in those of a cheap controller."""

    @property
    def episodes(self) -> int:
        """What it costs, in episodes of a cheap controller: for the progress, and the order of work."""
        return self.count * self.cost

    @property
    def name(self) -> str:
        """Its own among all blocks."""
        last = self.first_seed + self.count - 1
        where = f"{self.plants}, {self.scenario}, seeds {self.first_seed} to {last}"
        return f"{self.run_name} [{self.version}], {where}"

    def run(self, study: Study) -> dict[str, Any]:
        """Every figure of every episode, ready for JSON."""
        scenario = EVALUATION[RANDOM if self.scenario == TUNING else self.scenario]
        options = {**scenario.options, "parameters": plant_region(self.plants, study.plant)}
        seeds = list(range(self.first_seed, self.first_seed + self.count))
        metrics, _ = study.run(self.run_name, seeds, options)
        return {name: np.asarray(values).tolist() for name, values in asdict(metrics).items()}


def plan(contenders: list[Contender], scenarios: list[str], sizes: Sizes) -> list[Block]:
    """All blocks of a comparison."""
    blocks = []
    for contender in contenders:
        expense = EXPENSIVE.get(contender.name, CHEAP)
        for run_name, controller in contender.runs.items():
            own = partial(Block, run_name=run_name, version=fingerprint(controller), cost=expense.times)
            for (plants, scenario), wanted in _cases(contender, scenarios, sizes).items():
                first = TUNING_SEED if scenario == TUNING else EVALUATION_SEED
                block = partial(own, plants=plants, scenario=scenario)
                blocks += _cut(block, first, -(-wanted // expense.fewer))
    return blocks


def _cases(contender: Contender, scenarios: list[str], sizes: Sizes) -> dict[tuple[str, str], int]:
    """Episodes of each run by plant set and scenario."""
    if contender.price is not None:
        return {(plants, RANDOM): sizes.random for plants in (TRADED_ON, BARS_ON)}
    cases = {(p, scenario): sizes.of(p, scenario) for p in PLANTS for scenario in scenarios}
    if len(contender.runs) > 1:
        cases[TUNING_REGION, TUNING] = sizes.tuning
    return cases


def _cut(block: Callable[..., Block], first: int, count: int) -> list[Block]:
    """Batches that hold `count` episodes."""
    return [
        block(first_seed=first + begin, count=min(LARGEST_BATCH, count - begin))
        for begin in range(0, count, LARGEST_BATCH)
    ]


Results = dict[tuple[str, str, str], EpisodeMetrics]
"""Episodes by run, plant set and scenario."""


def collect(blocks: list[Block], found: Mapping[str, dict[str, Any]]) -> Results:
    """The blocks' episodes put together. found: what each block's `run` gave, by its name."""
    parts: dict[tuple[str, str, str], list[EpisodeMetrics]] = {}
    for block in blocks:
        arrays: dict[str, NDArray] = {k: np.array(v) for k, v in found[block.name].items()}
        key = block.run_name, block.plants, block.scenario
        parts.setdefault(key, []).append(EpisodeMetrics(**arrays))
    return {key: EpisodeMetrics.joined(several) for key, several in parts.items()}


def chosen_run(contender: Contender, results: Results) -> str:
    """Its run with the best mean return on the tuning scenarios; evaluations play no part in it."""
    if len(contender.runs) == 1:
        return next(iter(contender.runs))
    returns = {r: results[r, TUNING_REGION, TUNING].episode_return.mean() for r in contender.runs}
    return max(returns, key=lambda name: returns[name])
