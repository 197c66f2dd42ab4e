"""Simulated against measured: the figures of C1 to C3, and by how much the simulation was wrong."""

from typing import Any

import pandas as pd

from training.evaluation.metrics import summary
from training.evaluation.statistics import mean_interval
from training.studies.generated_pages import markdown
from training.studies.sim_to_real.deployment import (
    AROUND,
    ITSELF,
    MEASURED,
    PLACE_NAMES,
    SIMULATED,
    metrics_of,
)

KEYS = ["controller", "stage", "place"]

FIGURES = {
    "C1_stayed": (ITSELF, "C1_stayed", "C1 stayed"),
    "C1_worst_excursion_bar": (ITSELF, "C1_worst_excursion_bar", "C1 worst excursion [bar]"),
    "C2_mean_breakdown_bar": (ITSELF, "C2_mean_breakdown_bar", "C2 mean breakdown [bar]"),
    "C2_largest_breakdown_bar": (ITSELF, "C2_largest_breakdown_bar", "C2 largest breakdown [bar]"),
    "C3_stayed": (AROUND, "C1_stayed", "C3 stayed"),
    "C3_worst_excursion_bar": (AROUND, "C1_worst_excursion_bar", "C3 worst excursion [bar]"),
    "switchings_per_s": (ITSELF, "switchings_per_s", "switchings [1/s]"),
}
"""Set of plants, name in `summary` and heading of each figure; C3 is C1 on plants around the valve."""

GAPS = {
    "C1_excursion_bar": (ITSELF, "excursion_bar", "C1: excursion"),
    "C2_breakdown_bar": (ITSELF, "breakdown_bar", "C2: breakdown"),
    "C3_excursion_bar": (AROUND, "excursion_bar", "C3: excursion, ±10 %"),
}
"""Set of plants, field of EpisodeMetrics and heading of each gap."""

ENDS = ("low", "high")


def interval_column(name: str, end: str) -> str:
    """Name of an end of a figure's interval, as `summary` writes it: the unit comes last."""
    stem = name.removesuffix("_bar")
    return f"{stem}_{end}{name[len(stem) :]}"


def performance_table(episodes: pd.DataFrame) -> pd.DataFrame:
    """The figures of C1 to C3 with their 95 % intervals (`summary`).

    episodes: rows of `deployed` with their stage. Returns a row per controller, stage and place:
    the figures, and the ends of their intervals (`interval_column`) where they have one.
    """
    rows = []
    for _, group in episodes.groupby(KEYS, sort=False):
        summaries = {plants: summary(metrics_of(part)) for plants, part in group.groupby("plants")}
        row: dict[str, Any] = {key: group[key].iloc[0] for key in KEYS}
        for name, (plants, source, _) in FIGURES.items():
            row[name] = summaries[plants][source]
            for end in ENDS:
                if interval_column(source, end) in summaries[plants]:
                    row[interval_column(name, end)] = summaries[plants][interval_column(source, end)]
        rows.append(row)
    return _by_controller(rows)


def gap_table(episodes: pd.DataFrame) -> pd.DataFrame:
    """Measured minus simulated, episode by episode under the same random numbers, on average [bar].

    Returns a row per controller and stage; 95 % intervals by bootstrap over the episodes.
    """
    rows = []
    for _, group in episodes.groupby(KEYS[:2], sort=False):
        row: dict[str, Any] = {key: group[key].iloc[0] for key in KEYS[:2]}
        for name, (plants, field, _) in GAPS.items():
            part = group.loc[group["plants"] == plants]
            table = part.pivot(index="episode", columns="place", values=field)
            difference = (table[MEASURED] - table[SIMULATED]).to_numpy()
            row[name] = float(difference.mean())
            row |= dict(zip(_interval_columns(name), mean_interval(difference), strict=True))
        rows.append(row)
    return _by_controller(rows)


def as_markdown(aims: pd.DataFrame, differences: pd.DataFrame) -> str:
    """Both tables as they are printed and stand in docs/results/sim-to-real.md.

    aims: rows of `performance_table`; differences: rows of `gap_table`.
    """
    shown = aims.loc[:, [*KEYS, *FIGURES]]
    shown["place"] = [PLACE_NAMES[place] for place in aims["place"]]
    for name in ("C1_stayed", "C3_stayed"):
        shown[name] = [
            f"{value:.1%} ({low:.1%} to {high:.1%})"
            for value, low, high in aims.loc[:, [name, *_interval_columns(name)]].to_numpy()
        ]
    headings = {name: heading for name, (_, _, heading) in FIGURES.items()}
    gaps = differences.loc[:, KEYS[:2]]
    for name, (_, _, heading) in GAPS.items():
        columns = [name, *_interval_columns(name)]
        gaps[f"{heading} [mbar]"] = [
            f"{value:+.0f} ({low:+.0f} to {high:+.0f})"
            for value, low, high in (1e3 * differences.loc[:, columns]).to_numpy()
        ]
    return f"{_table(shown.rename(columns=headings))}\n\n{_table(gaps)}"


def _by_controller(rows: list[dict[str, Any]]) -> pd.DataFrame:
    """One controller after another, each in the order of its rows."""
    order = list(dict.fromkeys(row["controller"] for row in rows))
    return pd.DataFrame(sorted(rows, key=lambda row: order.index(row["controller"])))


def _interval_columns(name: str) -> list[str]:
    """Names of both ends of a figure's interval."""
    return [interval_column(name, end) for end in ENDS]


def _table(rows: pd.DataFrame) -> str:
    """Markdown, floats with three digits."""
    cells = [
        [f"{cell:.3f}" if isinstance(cell, float) else str(cell) for cell in row]
        for row in rows.itertuples(index=False)
    ]
    return markdown(list(rows.columns), cells)
