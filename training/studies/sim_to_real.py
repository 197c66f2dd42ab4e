"""Simulated against measured: figures before and after a correction, their gap, and a picture."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from training.evaluation.metrics import EpisodeMetrics, summary, violation_interval
from training.evaluation.plots import COLOURS, plt
from training.evaluation.statistics import paired_difference

BEFORE, AFTER = "before", "after"
"""Stages: trained on the nominal plant, retrained on the corrected one."""

SIMULATED, MEASURED = "simulated", "measured"
"""Places: the simulation that the controller was made on, and the bench's valve."""

ITSELF, AROUND = "calibrated", "ten_percent"
"""Plant sets: the valve itself (C1, C2), others around it with the calibrated four in ±10 % (C3)."""

Deployments = Mapping[tuple[str, str, str, str], EpisodeMetrics]
"""Episodes by stage, place, plant set and controller; simulated and measured ones are the same."""

GAPS = {
    "C1_excursion_mbar": (ITSELF, "excursion_bar"),
    "C2_breakdown_mbar": (ITSELF, "breakdown_bar"),
    "C3_excursion_mbar": (AROUND, "excursion_bar"),
}
"""Plant set and field of EpisodeMetrics of each gap."""


def performance_table(deployments: Deployments) -> pd.DataFrame:
    """A row for each stage, place, plant set and controller: share that leaves, and `summary`.

    `left_percent` is the share of episodes that left ±500 mbar, with its exact 95 % interval.
    """
    table = []
    for (stage, place, plants, controller), metrics in deployments.items():
        low, high = (100 * end for end in violation_interval(metrics.stayed))
        table.append(
            {
                "controller": controller, "stage": stage, "place": place, "plants": plants,
                "left_percent": 100 * float(np.mean(~metrics.stayed)), "left_low": low,
                "left_high": high, **summary(metrics),
            }
        )  # fmt: skip
    return pd.DataFrame(table)


def gap_table(deployments: Deployments) -> pd.DataFrame:
    """Measured minus simulated, paired by episode, on average [mbar], with 95 % intervals.

    A row for each controller and stage; columns NAME, NAME_low, NAME_high for each of GAPS.
    """
    table: dict[tuple[str, str], dict[str, Any]] = {}
    for stage, place, plants, controller in deployments:
        if place != SIMULATED:
            continue
        row = table.setdefault((controller, stage), {"controller": controller, "stage": stage})
        for name, (where, field) in GAPS.items():
            if where == plants:
                pair = (
                    1e3 * getattr(deployments[stage, at, plants, controller], field)
                    for at in (MEASURED, SIMULATED)
                )
                found = paired_difference(*pair)
                row |= {name: found.value, f"{name}_low": found.low, f"{name}_high": found.high}
    return pd.DataFrame(list(table.values()))


def short_table(performance: pd.DataFrame, gaps: pd.DataFrame) -> pd.DataFrame:
    """What is printed: a row for each controller and stage, with headings."""
    table = []
    for gap in gaps.to_dict("records"):
        row: dict[str, Any] = {"controller": gap["controller"], "stage": gap["stage"]}
        own: Any = performance[
            (performance["controller"] == gap["controller"]) & (performance["stage"] == gap["stage"])
        ]
        for place in (SIMULATED, MEASURED):
            for plants, where in ((ITSELF, ""), (AROUND, ", ±10 %")):
                part: Any = own[(own["place"] == place) & (own["plants"] == plants)].iloc[0]
                row[f"{place} leaves{where} [%]"] = f"{part['left_percent']:.1f}"
        ends = [gap["C1_excursion_mbar"], gap["C1_excursion_mbar_low"], gap["C1_excursion_mbar_high"]]
        row["excursion, measured minus simulated [mbar]"] = "{:+.0f} ({:+.0f} to {:+.0f})".format(*ends)
        table.append(row)
    return pd.DataFrame(table)


def performance_figure(performance: pd.DataFrame) -> Figure:
    """Share that leaves on the valve itself: open circles simulated, full ones measured; 95 % bars."""
    names = list(dict.fromkeys(performance["controller"]))
    figure, panels = plt.subplots(
        1, 2, figsize=(7.2, 1.6 + 0.35 * len(names)), sharey=True, layout="constrained"
    )
    own: Any = performance[performance["plants"] == ITSELF]
    for axes, (stage, title) in zip(
        panels,
        ((BEFORE, "trained on the nominal plant"), (AFTER, "on the corrected plant")),
        strict=True,
    ):
        for place, fill, size in ((SIMULATED, "white", 9), (MEASURED, COLOURS[0], 5)):
            rows = (
                own[(own["stage"] == stage) & (own["place"] == place)].set_index("controller").loc[names]
            )
            places = np.arange(len(names))
            axes.hlines(places, rows["left_low"], rows["left_high"], color=COLOURS[0], alpha=0.5)
            axes.plot(rows["left_percent"], places, "o", color=COLOURS[0], mfc=fill, ms=size)
        axes.set(xlabel="episodes that leave ±500 mbar [%]", xlim=(-4, 104))
        axes.set_title(title, fontsize=11)
        axes.grid(alpha=0.3, axis="x")
    panels[0].set_yticks(np.arange(len(names)), names)
    panels[0].set_ylim(len(names) - 0.5, -0.5)
    handles = [
        Line2D([], [], color=COLOURS[0], ls="", marker="o", mfc=fill, label=label)
        for fill, label in (("white", SIMULATED), (COLOURS[0], "measured on the bench's valve"))
    ]
    figure.legend(handles=handles, ncols=2, loc="outside upper center")
    return figure


def diagnosis_text(diagnosis: Mapping[str, Any], withheld: str) -> str:
    """The withheld effect and the diagnosis (gap.json), in two sentences."""
    names = " or ".join(" + ".join(effects) for effects in diagnosis["ambiguity_set"])
    if not names:
        return (
            f"Withheld: {withheld}. Diagnosis: {diagnosis['verdict']}; the plant is recalibrated only."
        )
    first = diagnosis["causes"][0]
    sizes = ", ".join(
        f"{name} {value:.4g} (95 %: {low:.4g} to {high:.4g})"
        for name, (value, low, high) in first["magnitude"].items()
    )
    return (
        f"Withheld: {withheld}. Diagnosis: {diagnosis['verdict']}, {names}; the likeliest has "
        f"probability {first['probability']:.3f} and {sizes}."
    )
