"""Run the episodes that statement.json announced before any of them was run.

    python -m docs.studies.rare.statement --episodes 24000    # so many of each region; it resumes

The statement names the policy by its digest, the plants and the seeds. Finished batches lie in
statement.jsonl beside it, each with the seeds that left.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from controllers.policy import TRAINED, load_policy
from controllers.policy_files import policy_digest
from docs.studies.common import PAGE, fill, table
from docs.studies.freshness import stale_tables
from epv_env.common.command_line import fail_clearly
from epv_env.common.files import Journal, read_json
from epv_env.common.options import COUNT
from training.evaluation.batches import run_jobs
from training.evaluation.metrics import violation_interval
from training.evaluation.plots import in_words
from training.evaluation.rollout import run_episodes

FOLDER = Path(__file__).parent
STATEMENT, RESULTS = FOLDER / "statement.json", FOLDER / "statement.jsonl"
FORMAT = "epv-statement/1"
BATCH = 1000
"""Episodes of a batch: half a minute of one core."""
WORST = 5
"""Largest excursions of a batch that are kept with their seeds."""


@dataclass(frozen=True, kw_only=True)
class Statement:
    """What was announced."""

    policy: str
    """Digest of the policy's files."""
    regions: list[str]
    """From which the plants are drawn."""
    scenario: str
    """Consumption."""
    episodes: int
    """Of each region."""
    first_seed: int
    """Of each region; the next episodes have the next seeds."""
    duration_s: float
    """Of an episode [s]."""
    tail_bar: list[float]
    """Excursions whose exceedances are counted [bar]; the last is the band's."""


def announced() -> Statement:
    """The statement. Raises ValueError if it is about another policy than the package's."""
    statement = read_json(STATEMENT, Statement, version=FORMAT, remedy="restore it from the history")
    if statement.policy != policy_digest(TRAINED):
        raise ValueError(
            f"{STATEMENT} is about the policy {statement.policy}, and this is {policy_digest(TRAINED)}: "
            "restore the policy, or announce a new statement in another file"
        )
    return statement


def batch(
    scenario: str, duration: float, levels: list[float], region: str, first: int
) -> dict[str, Any]:
    """Figures of the episodes of BATCH seeds from `first` on; levels: whose exceedances count [bar]."""
    metrics = run_episodes(
        load_policy(), seeds=list(range(first, first + BATCH)), duration=duration,
        options={"threads": 1, "scenario": scenario, "parameters": region},
    )  # fmt: skip
    worst = np.argsort(metrics.excursion_bar)[: -WORST - 1 : -1]
    return {
        "left": (first + np.flatnonzero(~metrics.stayed)).tolist(),
        "above": [int(np.sum(metrics.excursion_bar > level)) for level in levels],
        "worst": [[first + int(k), float(metrics.excursion_bar[k])] for k in worst],
    }


def results(statement: Statement, journal: Journal, region: str) -> dict[str, Any]:
    """What is known of a region: episodes, seeds that left, the worst excursion and its seed."""
    found = [journal[name] for name in names(statement, region) if name in journal]
    return {
        "episodes": BATCH * len(found),
        "left": [seed for each in found for seed in each["left"]],
        "worst": max((each["worst"][0][::-1] for each in found), default=[0.0, 0]),
    }


def names(statement: Statement, region: str) -> dict[str, int]:
    """First seed of each batch of a region by the batch's name, in their order."""
    first = statement.first_seed
    return {f"{region}, {k}": k for k in range(first, first + statement.episodes, BATCH)}


def page_table(statement: Statement, journal: Journal) -> str:
    """A row for each region."""
    rows = []
    for region in statement.regions:
        known = results(statement, journal, region)
        n, left = known["episodes"], known["left"]
        low, high = violation_interval(np.arange(n) >= len(left)) if n else (0.0, 1.0)
        rows.append([
            in_words(region), f"{n:,} of {statement.episodes:,}", str(len(left)),
            f"{low:.2g} to {high:.2g}",
            f"{known['worst'][0]:.3f} (seed {known['worst'][1]})", ", ".join(map(str, left)) or "none",
        ])  # fmt: skip
    headings = ["plants", "episodes", "left", "95 % interval", "worst [bar]", "seeds that left"]
    return table(headings, rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what is missing; returns the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--episodes", type=COUNT, help="of each region, from the first (default: all)")
    parser.add_argument("--workers", type=COUNT, help="processes (default: all cores)")
    options = parser.parse_args(arguments)
    statement = announced()
    remedy = f"restore {STATEMENT.name}, or move {RESULTS.name} away and announce the new statement"
    journal = Journal(RESULTS, {"statement": vars(statement)}, remedy=remedy)
    if len(journal) and any(table["name"] == "statement" for _, table in stale_tables()):
        raise ValueError(f"{RESULTS} holds episodes of other code: {remedy.partition(', or ')[2]}")
    count = -(-min(options.episodes or statement.episodes, statement.episodes) // BATCH)
    seeds = [
        (name, region, first)
        for region in statement.regions
        for name, first in list(names(statement, region).items())[:count]
    ]
    run = partial(batch, statement.scenario, statement.duration_s, statement.tail_bar)
    jobs = {name: partial(run, region, first) for name, region, first in seeds}
    run_jobs(jobs, journal=journal, workers=options.workers, what="statement")
    text = page_table(statement, journal)
    fill(FOLDER / PAGE, {"statement": text})
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
