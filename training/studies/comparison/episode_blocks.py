"""The episodes of a comparison: blocks that run side by side, and their joined results."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.common.files import Journal
from training.evaluation.controller_table import PLANTS, plant_region
from training.evaluation.metrics import EpisodeMetrics
from training.evaluation.scenarios import EVALUATION, RANDOM, TUNING_REGION
from training.evaluation.seeds import EVALUATION_SEED, TUNING_SEED
from training.studies.comparison.contenders import (
    CHEAP,
    CRITERIA_ON,
    EXPENSIVE,
    TRADE_OFF_ON,
    TUNING,
    TUNING_CONDITIONS,
    Contender,
    Expense,
    Results,
    Sizes,
)
from training.studies.episode_tasks import Study
from training.studies.fingerprint import fingerprint
from training.studies.parallel_run import TaskRunner, run_tasks

BLOCK_EPISODES = 512
"""Episodes side by side; larger batches are hardly faster, smaller ones resume in finer steps."""

EPISODE_OPTIONS = ("scenario", "target_bar")
"""Options that may differ from episode to episode of a block. A supply might, but then costs more."""


@dataclass(frozen=True, kw_only=True)
class Block:
    """Episodes side by side of one controller and plant set: as many in each of some scenarios.

    A batch of 32 takes four times as long for an episode as one of 512, so that scenarios share one.
    """

    run_name: str
    """Which of the study's controllers."""
    version: str
    """Its fingerprint: results of an earlier version are not taken for this one's."""
    plants: str
    scenarios: tuple[str, ...]
    """Their options are the same but for EPISODE_OPTIONS."""
    first_seed: int
    count: int
    """Episodes of each scenario."""
    cost: int = 1
    """Cost of an episode, in episodes of a cheap controller."""

    @property
    def episodes(self) -> int:
        """Cost in episodes of a cheap controller: for the progress bar and the order of work."""
        return len(self.scenarios) * self.count * self.cost

    @property
    def name(self) -> str:
        """A name that no other block of the comparison has."""
        last = self.first_seed + self.count - 1
        where = f"{self.plants}, {' + '.join(self.scenarios)}, seeds {self.first_seed} to {last}"
        return f"{self.run_name} [{self.version}], {where}"

    def run(self, study: Study) -> dict[str, Any]:
        """Every figure of every episode, one scenario after another, ready for JSON."""
        asked = [_options(scenario) for scenario in self.scenarios]
        differing = [o for o in EPISODE_OPTIONS if any(own.get(o) != asked[0].get(o) for own in asked)]
        common = {name: value for name, value in asked[0].items() if name not in differing}
        common["parameters"] = plant_region(self.plants, study.plant)
        each = {o: [own.get(o) for own in asked for _ in range(self.count)] for o in differing}
        seeds = list(range(self.first_seed, self.first_seed + self.count)) * len(asked)
        metrics, _ = study.run(self.run_name, seeds, common, each)
        return {name: np.asarray(values).tolist() for name, values in asdict(metrics).items()}


def _options(scenario: str) -> dict[str, Any]:
    """Of the environment; the tuning's scenarios are random ones under harder conditions."""
    if scenario == TUNING:
        return {**EVALUATION[RANDOM].options, "conditions": TUNING_CONDITIONS}
    return EVALUATION[scenario].options


def plan(
    contenders: list[Contender], scenarios: list[str], sizes: Sizes, first_seed: int = EVALUATION_SEED
) -> list[Block]:
    """All blocks of a comparison. first_seed: of the evaluation's episodes."""
    blocks = []
    for contender in contenders:
        expense = EXPENSIVE.get(contender.name, CHEAP)
        together = _sharing_blocks(_cases(contender, scenarios, sizes), expense, first_seed)
        for run_name, controller in contender.runs.items():
            own = partial(Block, run_name=run_name, version=fingerprint(controller), cost=expense.times)
            for (plants, first, count, _), alike in together.items():
                blocks += _blocks_of(partial(own, plants=plants), alike, first, count)
    return blocks


def _cases(contender: Contender, scenarios: list[str], sizes: Sizes) -> dict[tuple[str, str], int]:
    """Episodes of each run by plant set and scenario."""
    if contender.price is not None:
        return {(plants, RANDOM): sizes.random for plants in (TRADE_OFF_ON, CRITERIA_ON)}
    cases = {(p, scenario): sizes.of(p, scenario) for p in PLANTS for scenario in scenarios}
    if len(contender.runs) > 1:
        cases[TUNING_REGION, TUNING] = sizes.tuning
    return cases


def _sharing_blocks(
    cases: dict[tuple[str, str], int], expense: Expense, first_seed: int
) -> dict[tuple[str, int, int, str], list[str]]:
    """Scenarios that can share blocks, by plant set, first seed, episodes, and their other options."""
    together: dict[tuple[str, int, int, str], list[str]] = {}
    for (plants, scenario), wanted in cases.items():
        first = TUNING_SEED if scenario == TUNING else first_seed
        others = {name: v for name, v in _options(scenario).items() if name not in EPISODE_OPTIONS}
        key = plants, first, expense.episodes(plants, scenario, wanted), repr(others)
        together.setdefault(key, []).append(scenario)
    return together


def _blocks_of(block: Callable[..., Block], scenarios: list[str], first: int, count: int) -> list[Block]:
    """Blocks that hold `count` episodes of each scenario."""
    if count == 0:
        return []
    together = max(BLOCK_EPISODES // count, 1)
    return [
        block(
            scenarios=tuple(scenarios[k : k + together]),
            first_seed=first + begin, count=min(BLOCK_EPISODES, count - begin),
        )
        for k in range(0, len(scenarios), together)
        for begin in range(0, count, BLOCK_EPISODES)
    ]  # fmt: skip


def block_results(
    blocks: list[Block], study: Study, journal: Path, run: TaskRunner, *, what: str
) -> Results:
    """Episodes of all blocks by run, plant set and scenario; only those that are missing are run.

    Args:
        blocks: of the study.
        study: with the controllers that the blocks name.
        journal: file of finished blocks; it begins anew for another plant, duration or set of scenarios.
        run: where the blocks run (`task_runner`).
        what: name of the progress bar.
    """
    subject = {
        "plant": dict(study.plant.parameters),
        "duration": study.duration,
        "figures": [entry.name for entry in fields(EpisodeMetrics)],
        "scenarios": {name: repr(scenario.options) for name, scenario in EVALUATION.items()},
    }
    outcomes = run_tasks(blocks, study, Journal(journal, subject), run, what=what)
    return joined_results(blocks, {name: outcome["result"] for name, outcome in outcomes.items()})


def joined_results(blocks: list[Block], outcomes: Mapping[str, dict[str, Any]]) -> Results:
    """Episodes of all blocks by run, plant set and scenario.

    outcomes: the results of `Block.run` by the name of the block.
    """
    parts: dict[tuple[str, str, str], list[EpisodeMetrics]] = {}
    for block in blocks:
        arrays: dict[str, NDArray] = {k: np.array(v) for k, v in outcomes[block.name].items()}
        for k, scenario in enumerate(block.scenarios):
            rows = slice(k * block.count, (k + 1) * block.count)
            own = EpisodeMetrics(**{name: values[rows] for name, values in arrays.items()})
            parts.setdefault((block.run_name, block.plants, scenario), []).append(own)
    return {key: EpisodeMetrics.joined(several) for key, several in parts.items()}
