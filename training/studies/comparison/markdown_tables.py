"""The comparison in words and tables: the parts that docs/results/comparison.md and README.md hold."""

from collections.abc import Sequence
from typing import Any

import pandas as pd

from controllers.tuned import load_search, load_tunings
from training.evaluation.controller_table import PLANTS
from training.evaluation.scenarios import EVALUATION, NAMED
from training.studies.comparison.acceptance_criteria import Criterion
from training.studies.comparison.score_tables import FRONT, SCORES, SEED_SCORES, ComparisonResults
from training.studies.generated_pages import markdown
from training.studies.result_files import records

FIGURES = {
    "C1 worst [bar]": "C1_worst_excursion_bar",
    "C1 99.9 % [bar]": "C1_tail_excursion_bar",
    "C2 largest breakdown [bar]": "C2_largest_breakdown_bar",
    "C2 breakdown per event [bar]": "C2_event_breakdown_bar",
    "C2 recovery per event, mean / longest [s]": "C2_event_recovery_s/C2_longest_event_recovery_s",
    "rms error [bar]": "rms_error_bar",
    "switchings [1/s]": "switchings_per_s",
    "vented [g/s]": "vented_g_per_s",
    "coil [W]": "coil_W",
}
"""Columns of the main table, and where `summary` has them."""
README_CONTROLLERS = (
    "PPO, end to end, supervised",
    "PPO, recurrent, supervised",
    "pulse, adaptive",
    "hysteresis, extrapolating",
    "PWM",
    "pulse, informed",
)
"""Rows of the README's table, by the names that the main table shows."""


def results_table(table: pd.DataFrame) -> str:
    """The main table: rows of `score_tables.figures`."""
    headings = ["plants", "controller", "episodes", "C1 violation rate (95 % interval)", *FIGURES]
    rows, last = [], ""
    for row in records(table):
        figures = [" / ".join(f"{row[k]:.3f}" for k in keys.split("/")) for keys in FIGURES.values()]
        plants = row["plants"] if row["plants"] != last else ""
        last = row["plants"]
        rows.append(
            [plants, row["controller"], str(row["episodes"]), violation_rate_text(row), *figures]
        )
    return markdown(headings, rows)


def violation_rate_text(row: dict[str, float]) -> str:
    """Violation rate: share of the episodes that left target ±500 mbar, with its interval."""
    shares = (100 * (1 - row[k]) for k in ("C1_stayed", "C1_stayed_high", "C1_stayed_low"))
    return "{:.2f} % ({:.2f} to {:.2f} %)".format(*shares)


def short_table(table: pd.DataFrame) -> str:
    """The README's table: a row for each of README_CONTROLLERS that took part, in this order.

    Each cell holds the figure on every plant set, in the order of PLANTS.
    """
    headings = {
        "worst excursion [bar]": "C1_worst_excursion_bar",
        "rms error [bar]": "rms_error_bar",
        "switchings [1/s]": "switchings_per_s",
    }
    groups = dict(iter(table.groupby("controller")))
    rows = []
    for name in (name for name in README_CONTROLLERS if name in groups):
        of = groups[name].set_index("plants").loc[list(PLANTS)]
        shares = " / ".join(f"{100 * (1 - stayed):.2f}" for stayed in of["C1_stayed"]) + " %"
        cells = [" / ".join(f"{value:.3g}" for value in of[column]) for column in headings.values()]
        rows.append([name, shares, *cells])
    return markdown(["controller", "violations of ±500 mbar", *headings], rows)


def iqm_table(means: pd.DataFrame) -> str:
    """Interquartile means over the scenarios with their intervals."""
    rows = []
    for (plants, name), cells in _grouped(means, "controller").items():
        shown = [f"{r['value']:.3f} ({r['value_low']:.3f} to {r['value_high']:.3f})" for r in cells]
        rows.append([plants, name, *shown])
    return markdown(["plants", "controller", *SCORES.values()], rows)


def paired_comparison_tables(paired: pd.DataFrame) -> str:
    """For each learned controller the paired differences, and the probability that it is better."""
    return "\n\n".join(
        _paired_comparison_table(rows, str(ours)) for ours, rows in paired.groupby("ours", sort=False)
    )


def _paired_comparison_table(paired: pd.DataFrame, ours: str) -> str:
    rows = []
    for (plants, rival), cells in _grouped(paired, "rival").items():
        shown = [
            f"{r['difference']:+.3f} ({r['difference_low']:+.3f} to {r['difference_high']:+.3f}); "
            f"{100 * r['better']:.0f} %"
            for r in cells
        ]
        rows.append([plants, rival, *shown])
    return markdown(["plants", f"{ours} against", *SCORES.values()], rows)


def seeds_table(differences: pd.DataFrame, rival: str) -> str:
    """Each training seed against a rival: rows of `score_tables.seed_differences`."""
    if differences.empty:
        return f"No supervised policy met the controller {rival!r} in this comparison."
    rows = []
    for row in records(differences):
        shown = []
        for score, (_, factor) in SEED_SCORES.items():
            value, low, high = (factor * row[score + end] for end in ("", "_low", "_high"))
            shown.append(f"{value:+.2f} ({low:+.2f} to {high:+.2f})")
        left = f"{row['left']} against {row['rival_left']} of {row['episodes']}"
        rows.append([row["run"], left, *shown])
    return markdown([f"against {rival}", "left the band", *(h for h, _ in SEED_SCORES.values())], rows)


def _grouped(table: pd.DataFrame, column: str) -> dict[tuple[str, str], list[dict[str, Any]]]:
    """Rows by plant set and controller, one per score in the order of SCORES."""
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for row in records(table):
        groups.setdefault((row["plants"], row[column]), []).append(row)
    return groups


def criteria_table(criteria: Sequence[Criterion], lost: Sequence[dict[str, str | float]]) -> str:
    """The acceptance criteria, and where a model-based rival is better."""
    rows = [[b.controller, b.requirement, b.measured, "yes" if b.met else "**no**"] for b in criteria]
    headings = ["controller", "acceptance criterion", "measured", "met?"]
    return markdown(headings, rows) + "\n\n" + lost_text(lost)


def lost_text(lost: Sequence[dict[str, str | float]]) -> str:
    """Where a model-based rival is better, as a table.

    lost: rows of `lost_to_model_based`.
    """
    if not lost:
        return "No model-based rival is better in any scenario."
    rows = [
        [
            *(str(row[k]) for k in ("rival", "plants", "scenario", "figure")),
            f"{1e3 * float(row['its_bar']):.0f}", f"{1e3 * float(row['ours_bar']):.0f}",
        ]
        for row in lost
    ]  # fmt: skip
    headings = ["wins", "plants", "scenario", "in", "its [mbar]", "ours [mbar]"]
    return "Where a model-based rival is better:\n\n" + markdown(headings, rows)


def trade_off_table(traded: pd.DataFrame) -> str:
    """Switching against the figures of FRONT; bold: on the Pareto front."""
    rows = []
    for row in records(traded.sort_values("switchings_per_s")):
        cells = [
            f"**{row[column]:.3f}**" if row[f"{column}_on_front"] else f"{row[column]:.3f}"
            for column in FRONT
        ]
        price, switchings = f"{row['switching_price']:g}", f"{row['switchings_per_s']:.2f}"
        rows.append([str(row["controller"]), price, switchings, *cells, str(row["episodes"])])
    headings = ["controller", "price", "switchings [1/s]", *FRONT.values(), "episodes"]
    return markdown(headings, rows)


def life_table(life: pd.DataFrame) -> str:
    """Switching life by controller, the longest first."""
    if life.empty:
        return "The scenarios of the switching life did not run."
    rows = [
        [row["controller"], *(f"{row[k]:.2f}" for k in ("at_rest", "in_service")), f"{row['years']:.2g}"]
        for row in records(life.sort_values("years", ascending=False))
    ]
    headings = ["controller", "switchings at rest [1/s]", "in service [1/s]", "life [years]"]
    return markdown(headings, rows)


def budget_text(c: ComparisonResults) -> str:
    """How the controllers were tuned and trained."""
    search, tunings = load_search(), load_tunings()
    efforts: dict[tuple[int, int], list[str]] = {}
    for kind, tuning in tunings.items():
        efforts.setdefault((tuning.trials, tuning.episodes), []).append(kind)
    each = (f"{t} trials of {e} episodes for {'; '.join(kinds)}" for (t, e), kinds in efforts.items())
    strict = [name for name, tuning in tunings.items() if tuning.objective != "reward"]
    text = (
        f"Tuning: {search['method']}, seed {search['seed']}, episodes of {search['duration']:g} s on "
        f"plants of the region {search['parameters']}. {'. '.join(each)}."
    )
    if strict:
        text += f" Under the stricter prices of the policy's training: {'; '.join(strict)}."
    for contender in c.contenders:
        if contender.learned:
            text += (
                f" {contender.name}: {len(contender.runs)} training seeds on the same plants; the one "
                f"that stands for it ({c.chosen[contender.name]}) leaves the band least often on hard "
                "tuning episodes."
            )
    return text


def episodes_text(c: ComparisonResults) -> str:
    """How many episodes stand behind the scenarios' figures of each contender."""
    text = []
    for contender in c.contenders:
        run = c.chosen[contender.name]
        counts = {len(m) for (name, _, where), m in c.results.items() if name == run and where in NAMED}
        if counts:
            text.append(f"{contender.name} {min(counts)}")
    return (
        "Episodes in each named scenario and plant set: "
        + ", ".join(text)
        + ". Comparisons in pairs use "
        "those that both have run."
    )


def scenario_table(scenarios: Sequence[str]) -> str:
    """The scenarios and their meaning."""
    return markdown(["scenario", "meaning"], [[name, EVALUATION[name].meaning] for name in scenarios])
