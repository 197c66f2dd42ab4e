"""The sim-to-real loop: its trainings, what a diagnosis says, and simulated against measured."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from controllers.base import Controller
from controllers.policy import load_policy
from controllers.policy_files import holds_policy
from epv_env.common.files import decoded, digest
from epv_env.common.results_folder import check_options, write_options
from epv_env.plant.plantfile import Plant, load_plant, plant_subject
from epv_env.plant.region import Alternative, Mixture, Region
from epv_env.reward import RewardWeights
from identification.gap.report.gap_json import GAP
from training.evaluation.plots import plt
from training.studies.comparison import Results, differences

SCENARIO = "mixed"
"""Consumption of trainings and deployments."""
SWITCHING_PRICE = 0.2
"""Price of a switching in the reward [1]. Below the default: at a high price, so short a training has
not learned to control yet."""

SIMULATED, MEASURED = "simulated", "measured"
"""Places: the simulation that the controller was made on, and the bench's valve."""


CORRECTED = "plant.json"
"""Plant file that a diagnosis writes."""


def trained(
    folder: Path, plant: Plant, parameters: str | Region | Mixture, *, seed: int, timesteps: int,
    **validation: Any,
) -> Controller:  # fmt: skip
    """PPO trained on these plants, or as it was trained before.

    Raises ValueError for the folder of another training.

    Args:
        folder: of the training.
        plant: that is simulated.
        parameters: plants around it that are trained on.
        seed: of the training.
        timesteps: environment steps of the training.
        validation: more of the arguments of `training.learners.ppo.train`.
    """
    plants = digest(json.dumps([plant_subject(plant), repr(parameters)]).encode())
    about = {"plants": plants, "seed": seed, "timesteps": timesteps}
    check_options(folder, about, "policy")
    if not holds_policy(folder):
        write_options(folder, about)
        from training.learners.ppo import Task, train  # torch takes seconds to import: only now

        weights = RewardWeights(switching=SWITCHING_PRICE)
        task = Task(plant=plant, scenario=SCENARIO, parameters=parameters, weights=weights)
        train(
            task, folder, seed=seed, timesteps=timesteps, resume=True,
            provenance={"plant": plant.name}, **validation,
        )  # fmt: skip
    return load_policy(folder, plant)


def alternatives(plant: Plant) -> tuple[Alternative, ...]:
    """What a diagnosis holds possible."""
    return plant.diagnosis.alternatives if plant.diagnosis else ()


def diagnosis_text(folder: Path) -> str:
    """Verdict and alternatives of the diagnosis in a folder."""
    verdict = decoded(folder / GAP, remedy=f"remove {folder}, and the diagnosis runs again")["verdict"]
    best, *others = alternatives(load_plant(folder / CORRECTED))
    first = f"{verdict}: {best.name.replace('_', ' ')} {best.probability:.2f}"
    return first + (f", {len(others)} more" if others else "")


def gap_table(results: Results) -> pd.DataFrame:
    """Measured minus simulated: `differences` by plants, stage, controller and score.

    results: episodes by plant set, "STAGE, PLACE" and controller; those of both places are the same.
    """
    stages: Results = {}
    for (plants, scenario, controller), metrics in results.items():
        stage, place = scenario.split(", ")
        stages[plants, f"{stage}, {controller}", place] = metrics
    table = differences(stages, SIMULATED)
    table[["stage", "controller"]] = table.pop("scenario").str.split(", ", n=1, expand=True)
    return table


def share_picture(
    shares: pd.DataFrame, marks: Mapping[str, tuple[str, str, float]], *, title: str = ""
) -> Figure:
    """Episodes that leave the band [%]: a line for each row, a mark for each column.

    marks: marker, its inside's colour and its size [points], by column of `shares`. title: of the marks.
    """
    drawn, axes = plt.subplots(figsize=(7.2, 1.4 + 0.36 * len(shares)), layout="constrained")
    places = np.arange(len(shares))
    for name, (marker, inside, size) in marks.items():
        axes.plot(shares[name], places, marker, label=name, mfc=inside, mec="black", ms=size)
    axes.set_yticks(places, list(shares.index))
    axes.set(xlabel="episodes that leave ±500 mbar [%]", xlim=(-2, None))
    axes.set_ylim(len(shares) - 0.5, -0.5)
    axes.grid(alpha=0.3)
    drawn.legend(title=title, ncols=5, loc="outside upper center", frameon=False)
    return drawn
