"""Tables of a sweep's outcomes: violation rate with its interval, excursions, other figures."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import spearmanr

from training.evaluation.metrics import tail_excursion, violation_interval
from training.studies.parallel_run import Outcome
from training.studies.sweeps.episode_plan import SweepCell

FIGURES = ("breakdown_bar", "recovery_s", "rms_bar", "switchings_per_s", "vented_g_per_s")
"""Figures of an episode that the table holds beside the excursion (training/evaluation/metrics.py)."""


def point_table(cells: Sequence[SweepCell], outcomes: Mapping[str, Outcome]) -> pd.DataFrame:
    """One row for each point and controller.

    `left` is the violation rate of target ±500 mbar [1], with its exact 95 % interval; `worst_seed` the
    seed of the episode with the largest excursion. Other figures: mean (`rms_bar`: root mean square) and
    greatest.
    """
    return pd.DataFrame([_row(cell, _parts(cell, outcomes)) for cell in cells])


def _parts(cell: SweepCell, outcomes: Mapping[str, Outcome]) -> list[dict[str, Any]]:
    """Results of a cell's batches, in their order."""
    return [outcomes[batch.name]["result"] for batch in cell.batches]


def _row(cell: SweepCell, parts: list[dict[str, Any]]) -> dict[str, Any]:
    """A cell's row of `point_table`; parts: results of its batches."""
    excursion = np.concatenate([part["excursion_bar"] for part in parts])
    n, left = len(excursion), sum(part["left"] for part in parts)
    low, high = violation_interval(np.arange(n) >= left)
    row = {
        "design": cell.point.design, "factor": cell.point.factor, "level": cell.point.level,
        "controller": cell.controller, "episodes": n,
        "left": left / n, "left_low": low, "left_high": high,
        "excursion_median_bar": float(np.median(excursion)),
        "excursion_tail_bar": tail_excursion(excursion),
        "excursion_worst_bar": float(excursion.max()),
        "worst_seed": cell.batches[0].first_seed + int(np.argmax(excursion)),
    }  # fmt: skip
    for name in FIGURES:
        row |= _figure(name, [part["figures"][name] for part in parts])
    return row


def _figure(name: str, parts: list[dict[str, Any]]) -> dict[str, float]:
    """Mean and greatest value of one figure; for `rms_bar` the root mean square of all episodes."""
    count = max(sum(part["count"] for part in parts), 1)
    mean = sum(part["sum"] for part in parts) / count
    if name.startswith("rms"):
        mean = float(np.sqrt(sum(part["squares"] for part in parts) / count))
    greatest = [part["greatest"] for part in parts if part["greatest"] is not None]
    return {f"{name}_mean": mean, f"{name}_greatest": max(greatest, default=float("nan"))}


def rank_correlation_table(cells: Sequence[SweepCell], outcomes: Mapping[str, Outcome]) -> pd.DataFrame:
    """Spearman's rank correlation of each parameter with the excursion, over a Latin hypercube.

    `p_value`: of no association; a row for each parameter and controller.
    """
    rows = []
    for cell in cells:
        if cell.point.parameters is None:
            continue
        excursion = np.concatenate([part["excursion_bar"] for part in _parts(cell, outcomes)])
        plants = pd.DataFrame(cell.point.parameters)
        for symbol in plants:
            correlation: Any = spearmanr(plants[symbol], excursion)
            rows.append(
                {"controller": cell.controller, "symbol": symbol,
                 "rank_correlation": float(correlation.statistic), "p_value": float(correlation.pvalue)}
            )  # fmt: skip
    return pd.DataFrame(rows)
