"""Tables of a sweep in Markdown: printed, and written into the generated parts of pages."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from training.studies.generated_pages import markdown
from training.studies.sweeps.experiment_designs import ONE_AT_A_TIME

NAMED_LEVELS = 6
"""Levels that are named for each controller and design."""

NAMED_PARAMETERS = 4
"""Parameters that are named for each worst case."""

RANGE_ENDS = ("least", "greatest", "top")
"""Levels at the ends of a range, beyond what a sound valve has; they are counted apart."""


def joint_table(points: pd.DataFrame) -> str:
    """The regions and the Latin hypercube under each controller."""
    rows = [
        [
            row["level"], row["controller"], f"{row['episodes']}", violation_rate_text(row),
            f"{row['excursion_worst_bar']:.3f}", f"{row['excursion_tail_bar']:.3f}",
            f"{row['breakdown_bar_greatest']:.3f}", f"{row['rms_bar_mean']:.3f}",
            f"{row['switchings_per_s_mean']:.2f}",
        ]
        for _, row in points.iterrows()
        if row["design"] in ("regions", "hypercube")
    ]  # fmt: skip
    headings = (
        "plants", "controller", "episodes", "violations of ±500 mbar", "worst excursion [bar]",
        "99.9 % [bar]", "largest breakdown [bar]", "rms error [bar]", "switchings [1/s]",
    )  # fmt: skip
    return markdown(headings, rows)


def violation_rate_text(row: Any) -> str:
    """Violation rate of ±500 mbar with its exact interval; row: of `point_table`."""
    low, value, high = (100 * row[name] for name in ("left_low", "left", "left_high"))
    return f"{value:.3g} % ({low:.2g} to {high:.2g})"


def harmful_changes_table(points: pd.DataFrame) -> str:
    """How many changes of one thing raise the violation rate, and which ones most.

    A change hurts if its exact interval lies above that of the plant as it is.
    """
    rows = []
    controllers: Any = () if points.empty else points["controller"]
    for controller in dict.fromkeys(controllers):
        mine = points.loc[points["controller"] == controller]
        exact = mine.loc[mine["level"] == "exact", "left_high"]
        bound = float(exact.iloc[0]) if len(exact) else 0.0
        for design in ONE_AT_A_TIME:
            tried: Any = mine.loc[mine["design"] == design]
            for ends in (False, True):
                some = tried.loc[tried["level"].isin(RANGE_ENDS) == ends]
                if len(some):
                    what = f"{design}, ends of their ranges" if ends else design
                    rows.append([controller, what, *_harmful_changes(some, bound)])
    return markdown(("controller", "changed", "tried", "hurt", "most [% violations]"), rows)


def _harmful_changes(tried: pd.DataFrame, bound: float) -> tuple[str, str, str]:
    """Number of changes, of those that hurt, and the worst of them."""
    hurt = tried.loc[tried["left_low"] > bound].sort_values("left", ascending=False, kind="stable")
    named = [
        f"{row['factor']} {row['level']} ({100 * row['left']:.3g})"
        for _, row in hurt.head(NAMED_LEVELS).iterrows()
    ]
    return f"{len(tried)}", f"{len(hurt)}", "; ".join(named) or "–"


def worst_table(worst: Sequence[Mapping[str, Any]], nominal: Mapping[str, float]) -> str:
    """Worst cases: excursion after each stage, consumption, and how far the plant is off."""
    rows = []
    for each in worst:
        off = {s: 100 * (v / nominal[s] - 1) for s, v in each["parameters"].items()}
        farthest = sorted(off, key=lambda symbol: -abs(off[symbol]))[:NAMED_PARAMETERS]
        rows.append(
            [
                each["region"], each["controller"],
                " → ".join(f"{bar:.3f}" for bar in each["stages_bar"].values()),
                f"{each['bound_bar']:.3f}",
                f"{each['scenario']}, {each['seed']}",
                ", ".join(f"{symbol} {off[symbol]:+.2g} %" for symbol in farthest),
                f"{each['episodes']}",
            ]
        )  # fmt: skip
    headings = (
        "region", "controller", "worst excursion after each stage [bar]", "causal bound there [bar]",
        "scenario, seed", "farthest off", "episodes searched",
    )  # fmt: skip
    return markdown(headings, rows)


def cost_table(content: Mapping[str, Any], machines: int) -> str:
    """What a million episodes cost, and from what that follows (cost.py)."""
    rows = [
        [
            name, f"{1e3 * each['core_s_per_episode']:.1f} ms",
            in_words(each["million_on_one_machine_s"]),
            in_words(each[f"million_on_{machines}_machines_s"]),
        ]
        for name, each in content["controllers"].items()
    ]  # fmt: skip
    headings = ("controller", "a core's time for one", "a million on one machine", f"on {machines}")
    return (
        f"Episodes of {content['episode_duration_s']:g} s; machines like this one, "
        f"{content['cores_of_a_machine']} cores each; {content['tasks_handed_out_by']} hands out a task "
        f"of {content['episodes_of_a_task']} in {1e3 * content['overhead_of_a_task_s']:.2g} ms.\n\n"
        + markdown(headings, rows)
    )


def in_words(seconds: float) -> str:
    """A time in the unit that suits it."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
