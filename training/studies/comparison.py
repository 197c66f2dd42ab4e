"""Controllers on the same unseen episodes: figures, differences paired by episode, and a picture."""

from collections.abc import Collection, Mapping
from itertools import product

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from controllers.base import Controller
from epv_env.common.files import Journal
from epv_env.plant.plantfile import Plant
from epv_env.plant.region import DIAGNOSIS, REGIONS, Mixture, Region
from epv_env.settings import as_region
from training.evaluation.batches import Batch, run_batches
from training.evaluation.metrics import EpisodeMetrics, summary, violation_interval
from training.evaluation.plots import in_words, plt
from training.evaluation.scenarios import EvaluationScenario
from training.evaluation.seeds import EVALUATION_SEED
from training.evaluation.statistics import paired_difference

PLANTS = ("calibrated", "confidence", "sensitive_ten_percent")
"""The plant sets on which controllers are compared: the plant itself, and regions around it (C3)."""
PLANT_SETS = tuple(dict.fromkeys((*PLANTS, *REGIONS, DIAGNOSIS)))
"""All sets on which they can be compared; "exact" is "calibrated"."""

Results = dict[tuple[str, str, str], EpisodeMetrics]
"""Episodes by plant set, scenario and controller."""

SCORES = {
    "stayed": "violation rate [%]",
    "rms_bar": "rms error [mbar]",
    "event_breakdown_bar": "pressure dip [mbar]",
    "switchings_per_s": "switchings [1/s]",
    "episode_return": "return",
}
"""Fields of EpisodeMetrics that are compared in pairs."""

FACTORS = {"stayed": -100.0, "rms_bar": 1e3, "event_breakdown_bar": 1e3}
"""From a score to the unit of its heading; "stayed" becomes the violation rate."""

COLUMNS = {
    "plants": "plants",
    "scenario": "scenario",
    "controller": "controller",
    "left_percent": "violation rate [%]",
    "C1_worst_excursion_bar": "worst excursion [bar]",
    "rms_error_mbar": "rms error [mbar]",
    "C2_event_breakdown_mbar": "pressure dip [mbar]",
    "switchings_per_s": "switchings [1/s]",
    "mean_return": "return",
}
"""Columns that are printed, and their headings."""


def plant_region(plants: str, plant: Plant) -> Region | Mixture:
    """The plants that one of PLANT_SETS stands for. Raises OptionError if the plant lacks them."""
    if plants == "calibrated":
        return Region(centre=plant.parameters)
    if plants == "confidence":  # of a plant without a region: the plant itself
        return plant.region
    return as_region(plants, plant)


def compare(
    controllers: Mapping[str, Controller],
    *,
    plant: Plant,
    scenarios: Mapping[str, EvaluationScenario],
    episodes: int,
    duration: float,
    plant_sets: Collection[str] = PLANTS,
    first_seed: int = EVALUATION_SEED,
    workers: int | None = 1,
    journal: Journal | None = None,
    digests: Mapping[str, str] = {},
    device: str = "cpu",
) -> Results:
    """Run every controller in every scenario on every plant set, with common random numbers.

    Args:
        controllers: by label.
        plant: the calibrated plant and its confidence region.
        scenarios: by name.
        episodes: number of episodes of each cell.
        duration: length of an episode, where the scenario has none of its own [s].
        plant_sets: some of PLANT_SETS.
        first_seed: of the episodes of each cell.
        workers: processes; None: one for each core.
        journal: finished batches; new ones are added.
        digests: of the controllers by label: part of the batches' names in the journal.
        device: of the plants: "cpu", or "cuda" for an accelerator.
    """
    cells: dict[tuple[str, str, str], Batch] = {}
    for plants, (name, scenario), label in product(plant_sets, scenarios.items(), controllers):
        region = plant_region(plants, plant)
        cells[plants, name, label] = Batch(
            name=f"{plants}, {name}, {label} {digests.get(label, '')}".rstrip(),
            controller=label,
            first_seed=first_seed,
            episodes=episodes,
            duration=scenario.duration or duration,
            options={"plant": plant, "parameters": region, **scenario.options},
            restart_s=scenario.restart_s,
            faults=scenario.faults,
            device=device,
        )
    metrics = run_batches(
        list(cells.values()), controllers, journal=journal, workers=workers, what="comparison"
    )
    return dict(zip(cells, metrics, strict=True))


def rows(results: Results) -> pd.DataFrame:
    """A row for each plant set, scenario and controller: `summary`, and some figures in % and mbar."""
    table = []
    for (plants, scenario, label), metrics in results.items():
        figures = summary(metrics)
        low, high = (100 * end for end in violation_interval(metrics.stayed))
        table.append(
            {
                "plants": plants, "scenario": scenario, "controller": label,
                "left_percent": 100 * (1 - figures["C1_stayed"]), "left_low": low, "left_high": high,
                "rms_error_mbar": 1e3 * figures["rms_error_bar"],
                "C2_event_breakdown_mbar": 1e3 * figures["C2_event_breakdown_bar"],
                **figures,
            }
        )  # fmt: skip
    return pd.DataFrame(table)


def differences(results: Results, against: str) -> pd.DataFrame:
    """A row for each cell and score: the controller minus the one called `against`, paired by episode.

    Columns: plants, scenario, controller, score, difference, low, high (95 %, bootstrap), in the units
    of SCORES."""
    table = []
    for (plants, scenario, label), metrics in results.items():
        if label == against:
            continue
        theirs = results[plants, scenario, against]
        for field, heading in SCORES.items():
            factor = FACTORS.get(field, 1.0)
            pair = (factor * np.asarray(getattr(each, field), float) for each in (metrics, theirs))
            value, low, high = paired_difference(*pair)
            table.append(
                {
                    "plants": plants, "scenario": scenario, "controller": label, "score": heading,
                    "difference": value, "low": low, "high": high,
                }
            )  # fmt: skip
    return pd.DataFrame(table)


def as_text(table: pd.DataFrame) -> str:
    """Rows as they are printed: plant set and scenario only where they differ."""
    table = table.assign(plants=table["plants"].map(in_words))
    same = [name for name in ("plants", "scenario") if len(set(table[name])) == 1]
    shown = table.loc[:, [name for name in COLUMNS if name not in same]].rename(columns=COLUMNS)
    head = "; ".join(f"{name}: {table[name].iloc[0]}" for name in same)
    text = shown.to_string(index=False, float_format=lambda value: f"{value:.3g}")
    return f"{head}\n{text}" if head else text


PANELS = {
    "left_percent": "violation rate\n[%]",
    "C2_event_breakdown_mbar": "pressure dip\n[mbar]",
    "switchings_per_s": "switchings\n[1/s]",
}
"""What the picture shows, by column of `rows`."""


def figure(table: pd.DataFrame) -> Figure:
    """A line for each controller and a panel for each of PANELS. table: `rows` of one cell each.

    Bars are exact 95 % intervals of the violation rate.
    """
    names = list(table["controller"])
    drawn, panels = plt.subplots(
        1, len(PANELS), figsize=(7.2, 1.2 + 0.35 * len(names)), sharey=True, layout="constrained"
    )
    places = np.arange(len(names))
    for axes, (column, label) in zip(panels, PANELS.items(), strict=True):
        values = table[column].to_numpy(float)
        axes.plot(values, places, "o", color="C0")
        for place, value in enumerate(values):
            axes.annotate(
                f"{value:.2g}" if value < 100 else f"{value:.0f}", (value, place), (0, 6),
                textcoords="offset points", ha="center", fontsize=9,
            )  # fmt: skip
        if column == "left_percent":
            axes.hlines(places, table["left_low"], table["left_high"], color="C0")
            axes.set_xscale("symlog", linthresh=0.1)
            axes.set_xlim(-0.03, 300)
            axes.set_xticks([0, 0.1, 1, 10, 100], ["0", "0.1", "1", "10", "100"])
        else:
            axes.set_xlim(0, 1.25 * max(values.max(), 1e-3))
        axes.set_xlabel(label)
        axes.grid(alpha=0.3, axis="x")
    panels[0].set_yticks(places, names)
    panels[0].set_ylim(len(names) - 0.5, -0.7)
    return drawn
