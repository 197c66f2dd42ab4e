"""A table of controllers: each of them on the same unseen episodes and the same plants."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from controllers.base import Controller
from epv_env.plant.plantfile import Plant
from epv_env.plant.region import Region
from training.evaluation.metrics import EpisodeMetrics, summary
from training.evaluation.rollout import Trace, run_episodes
from training.evaluation.seeds import EVALUATION_SEED

PLANTS = {
    "calibrated": "the calibrated plant",
    "confidence": "drawn from its confidence region (C3)",
    "sensitive_ten_percent": "all 13 sensitive parameters each within ±10 % (C3)",
}
"""The plants on which controllers are compared."""


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """The outcome of a comparison."""

    table: pd.DataFrame
    """One row per plant set and controller."""
    metrics: dict[tuple[str, str], EpisodeMetrics]
    """Per-episode figures by plant set and controller."""
    traces: dict[str, Trace]
    """The same episode under each controller, on the calibrated plant."""


def plant_region(plants: str, plant: Plant) -> Region:
    """The region that a key of PLANTS stands for."""
    if plants == "calibrated":
        return Region(centre=plant.parameters)
    if plants == "confidence":
        return plant.region
    return Region.named(plants, plant.parameters)


def compare(
    controllers: list[Controller],
    *,
    plant: Plant,
    scenario: str,
    episodes: int,
    duration: float,
    progress: Callable[[str, float], None] = lambda what, share: None,
) -> Comparison:
    """Run every controller on every plant set with common random numbers.

    Args:
        controllers: of different names.
        plant: the calibrated plant and its confidence region.
        scenario: of the consumption.
        episodes: number of episodes on each plant set.
        duration: length of an episode [s].
        progress: called with the running controller and plant set, and the share done [1].
    """
    seeds = list(range(EVALUATION_SEED, EVALUATION_SEED + episodes))
    metrics: dict[tuple[str, str], EpisodeMetrics] = {}
    traces: dict[str, Trace] = {}
    runs = [(plants, controller) for plants in PLANTS for controller in controllers]
    for done, (plants, controller) in enumerate(runs):
        options: dict[str, Any] = {
            "plant": plant,
            "parameters": plant_region(plants, plant),
            "scenario": scenario,
        }
        label = f"{controller.name}, {plants}"
        metrics[plants, controller.name], trace = run_episodes(
            controller,
            seeds=seeds,
            duration=duration,
            options=options,
            trace_of=0 if plants == "calibrated" else None,
            progress=lambda share, at=done, what=label: progress(what, (at + share) / len(runs)),
        )
        if trace is not None:
            traces[controller.name] = trace
    return Comparison(table=summary_table(metrics), metrics=metrics, traces=traces)


def summary_table(metrics: Mapping[tuple[str, str], EpisodeMetrics]) -> pd.DataFrame:
    """A row per plant set and controller: `summary` of the episodes. metrics: by these two names."""
    rows = [{"plants": p, "controller": c, **summary(m)} for (p, c), m in metrics.items()]
    return pd.DataFrame(rows)


HEADINGS = {
    "controller": "controller",
    "C1_stayed": "C1 stayed",
    "C1_worst_excursion_bar": "C1 worst excursion [bar]",
    "C2_largest_breakdown_bar": "C2 largest breakdown [bar]",
    "C2_longest_recovery_s": "C2 longest recovery [s]",
    "rms_error_bar": "rms error [bar]",
    "switchings_per_s": "switchings [1/s]",
    "vented_g_per_s": "vented air [g/s]",
}


def as_text(table: pd.DataFrame) -> str:
    """The table as it is printed, one block for each plant set."""
    blocks = []
    for plants, meaning in PLANTS.items():
        rows = table.loc[table["plants"] == plants]
        shown = rows.loc[:, list(HEADINGS)].rename(columns=HEADINGS)
        shown = shown.assign(**{"C1 stayed": [f"{value:.1%}" for value in rows["C1_stayed"]]})
        blocks.append(f"{plants}: {meaning}\n" + shown.to_string(index=False, float_format="%.3f"))
    return "\n\n".join(blocks)
