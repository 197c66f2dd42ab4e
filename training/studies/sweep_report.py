"""Tables of a sweep: shares that leave the band, and excursions, by what is changed."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from training.evaluation.metrics import EpisodeMetrics, summary, violation_interval
from training.evaluation.plots import in_words
from training.studies.sweep_designs import ONE_AT_A_TIME, Point

NAMED_LEVELS = 3
"""Changes that are named for each controller and design: more would not fit a table's cell."""

RANGE_ENDS = ("least", "greatest", "top")
"""Levels at the ends of a range, beyond what a sound valve has; they are counted apart."""

HEADINGS = {
    "level": "plants",
    "controller": "controller",
    "left_text": "leaves [%]",
    "C1_worst_excursion_bar": "worst [bar]",
    "rms_error_bar": "rms [bar]",
    "switchings_per_s": "switchings [1/s]",
}
"""Columns of the table of regions."""

Cell = tuple[Point, str]
"""A point of a design under the controller of a label."""


def point_table(
    cells: Sequence[Cell], metrics: Sequence[EpisodeMetrics], first_seed: int
) -> pd.DataFrame:
    """A row for each point and controller.

    Columns: design, factor, level, controller; `left`, the share of episodes that left ±500 mbar [1],
    with its exact 95 % interval `left_low`, `left_high`; median excursion; the seed of the worst
    episode; and `summary`."""
    table = []
    for (point, controller), each in zip(cells, metrics, strict=True):
        low, high = violation_interval(each.stayed)
        table.append(
            {
                "design": point.design, "factor": point.factor, "level": point.level,
                "controller": controller, "left": 1 - float(np.mean(each.stayed)),
                "left_low": low, "left_high": high,
                "excursion_median_bar": float(np.median(each.excursion_bar)),
                "worst_seed": first_seed + int(np.argmax(each.excursion_bar)), **summary(each),
            }
        )  # fmt: skip
    return pd.DataFrame(table)


def share_text(row: Mapping[str, Any]) -> str:
    """Share that leaves with its exact interval, in %; row: of `point_table`."""
    low, value, high = (100 * row[name] for name in ("left_low", "left", "left_high"))
    return f"{value:.3g} ({low:.2g} to {high:.2g})"


def region_table(points: pd.DataFrame) -> pd.DataFrame:
    """The regions under each controller, with headings."""
    some: Any = points[points["design"] == "regions"]
    shown = some.assign(
        left_text=[share_text(row) for row in some.to_dict("records")], level=some["level"].map(in_words)
    )
    return shown.loc[:, list(HEADINGS)].rename(columns=HEADINGS)


def hurts(points: pd.DataFrame) -> pd.Series:
    """Of each point whether its exact interval lies above that of the plant as it is, (points,)."""
    exact: Any = points[points["level"] == "exact"].set_index("controller")["left_high"]
    bounds: Any = points["controller"].map(exact)
    return points["left_low"] > bounds.fillna(0.0)


def harmful_changes(points: pd.DataFrame) -> pd.DataFrame:
    """How many changes of one thing raise the share that leaves, and which ones most."""
    table, points = [], points.assign(hurts=hurts(points))
    for controller, mine in points.groupby("controller", sort=False):
        for design in ONE_AT_A_TIME:
            tried: Any = mine[mine["design"] == design]
            for ends in (False, True):
                some = tried[tried["level"].isin(RANGE_ENDS) == ends]
                if len(some) == 0:
                    continue
                hurt = some[some["hurts"]].sort_values("left", ascending=False, kind="stable")
                named = [
                    f"{row['factor']} {row['level']} ({100 * row['left']:.3g})"
                    for row in hurt.head(NAMED_LEVELS).to_dict("records")
                ]
                table.append(
                    {
                        "controller": controller,
                        "changed": f"{design}, ends of their ranges" if ends else design,
                        "tried": len(some), "hurt": len(hurt), "most [% leave]": "; ".join(named) or "–",
                    }
                )  # fmt: skip
    return pd.DataFrame(table)
