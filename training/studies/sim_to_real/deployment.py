"""Deploying controllers in simulation and on the bench: the same scenarios and random numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path

import numpy as np
import pandas as pd

from controllers.base import Controller
from epv_env.common.results_folder import progress
from epv_env.plant.plantfile import Plant
from training.evaluation.controller_table import plant_region
from training.evaluation.metrics import EpisodeMetrics
from training.evaluation.rollout import run_episodes
from training.evaluation.seeds import EVALUATION_SEED

BEFORE, AFTER = "before", "after"
"""Stages: trained on the nominal plant, retrained on the corrected one."""

SIMULATED, MEASURED = "promised", "delivered"
"""Places: the simulation that the controller was made on, and the bench's valve. These words stand in
episodes.csv and in the results, whose form does not change; tables and pictures show PLACE_NAMES."""

PLACE_NAMES = {SIMULATED: "simulated", MEASURED: "measured"}

ITSELF, AROUND = "calibrated", "ten_percent"
"""Plant sets: the valve itself (C1, C2), others around it with the calibrated four in ±10 % (C3)."""


def deployed(
    controllers: Sequence[Controller],
    plants: Mapping[str, Plant],
    *,
    scenario: str,
    count: int,
    duration: float,
    what: str,
) -> pd.DataFrame:
    """Run every controller at every place, on the plant itself and on others around it.

    Args:
        controllers: those to deploy.
        plants: the plant by place, SIMULATED and MEASURED.
        scenario: the consumption (epv_env/plant/consumption.py).
        count: episodes of each controller, place and plant set.
        duration: length of an episode [s].
        what: name of the progress bar.

    Returns:
        A row per episode: place, plants, controller, episode and the fields of EpisodeMetrics.
    """
    seeds = list(range(EVALUATION_SEED, EVALUATION_SEED + count))
    runs = [(p, s, c) for p in plants for s in (ITSELF, AROUND) for c in controllers]
    tables = []
    for place, plant_set, controller in progress(runs, what=what, total=len(runs)):
        region = plant_region(plant_set, plants[place])
        options = {"plant": plants[place], "parameters": region, "scenario": scenario}
        metrics, _ = run_episodes(controller, seeds=seeds, duration=duration, options=options)
        rows = pd.DataFrame({"episode": np.arange(count), **asdict(metrics)})
        tables.append(rows.assign(place=place, plants=plant_set, controller=controller.name))
    return pd.concat(tables, ignore_index=True)


def read_episodes(path: Path) -> pd.DataFrame:
    """The table of `deployed`, from a file. Raises ValueError for a table of another version."""
    episodes = pd.read_csv(path)
    missing = [f.name for f in fields(EpisodeMetrics) if f.name not in episodes]
    if missing:
        raise ValueError(
            f"{path} has no column {missing[0]}: another version of this program wrote it; remove its "
            "folder, or choose another --out"
        )
    return episodes


def metrics_of(episodes: pd.DataFrame) -> EpisodeMetrics:
    """The metrics that rows of `deployed` hold."""
    return EpisodeMetrics(**{f.name: episodes[f.name].to_numpy() for f in fields(EpisodeMetrics)})
