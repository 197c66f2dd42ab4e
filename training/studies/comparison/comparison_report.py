"""Writing a comparison: results.json, tables.md, figures, and the generated parts of pages."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from epv_env.common.files import write_bytes, write_json, write_text
from training.evaluation import plots
from training.evaluation.controller_table import PLANTS, Comparison
from training.evaluation.rollout import Trace
from training.studies.comparison import comparison_figures, markdown_tables, score_tables
from training.studies.comparison.acceptance_criteria import Criterion, criteria, lost_to_model_based
from training.studies.comparison.contenders import TRADE_OFF_ON, Contender
from training.studies.comparison.score_tables import ComparisonResults
from training.studies.generated_pages import fill
from training.studies.result_files import records

RESULTS_FILE, TABLES_FILE = "results.json", "tables.md"

PARTS = (
    "results", "short", "bars", "duels", "means", "trade", "life", "scenarios", "tuning",
    "episodes", "seeds",
)  # fmt: skip
"""Generated parts that a page can ask for: "bars" are the acceptance criteria, "duels" the paired
comparisons, under the names that pages and results.json have for them."""

SCENARIO_MAPS = "comparison-scenarios"
MEANS = "comparison-means"
PAIRED = "comparison-paired"
"""Names of the figures that generated parts show, as pages beside the folder `images` find them."""

RIVAL = "pulse, adaptive"
"""Whom each training seed is set against: the best of the classic controllers."""

NOBODY = "No learned controller took part in this comparison."


@dataclass(frozen=True, kw_only=True)
class ComparisonTables:
    """Every table of a comparison (score_tables.py, acceptance_criteria.py)."""

    figures: pd.DataFrame
    scenarios: pd.DataFrame
    means: pd.DataFrame
    trade_off: pd.DataFrame
    life: pd.DataFrame
    """Switching life; empty without its scenarios."""
    ours: Contender | None
    """The first learned contender, if one takes part."""
    paired: pd.DataFrame
    """Of every learned contender against all others."""
    seeds: pd.DataFrame
    """Each training seed of the supervised policies against RIVAL; empty if it takes no part."""
    criteria: list[Criterion]
    lost: list[dict[str, str | float]]
    """Where a model-based rival is better."""


def comparison_tables(c: ComparisonResults, *, trade_off_episodes: int) -> ComparisonTables:
    """Compute all tables. trade_off_episodes: so many, the first, are the trade-off's."""
    learned = [each for each in c.contenders if each.learned]
    ours = learned[0] if learned else None
    return ComparisonTables(
        figures=score_tables.figures(c),
        scenarios=score_tables.by_scenario(c),
        means=score_tables.interquartile_means(c),
        trade_off=score_tables.trade_off(c, trade_off_episodes),
        life=score_tables.switching_life(c),
        ours=ours,
        paired=pd.concat(
            [score_tables.paired_comparisons(c, each) for each in learned] or [pd.DataFrame()]
        ),
        seeds=_seeds(c, [each for each in learned if each.supervised]),
        criteria=[criterion for each in learned for criterion in criteria(c, each)],
        lost=[] if ours is None else lost_to_model_based(c, ours),
    )


def _seeds(c: ComparisonResults, supervised: Sequence[Contender]) -> pd.DataFrame:
    if not supervised or RIVAL not in c.chosen:
        return pd.DataFrame()
    return pd.concat([score_tables.seed_differences(c, each, RIVAL) for each in supervised])


def write_tables(
    c: ComparisonResults,
    tables: ComparisonTables,
    *,
    settings: Mapping[str, Any],
    out: Path,
    pages: Sequence[Path],
) -> str:
    """Write results.json, tables.md and the pages' generated parts; return the main table.

    settings: what was asked for, kept in results.json.
    """
    content: dict[str, Any] = {
        "settings": dict(settings), "tuning": markdown_tables.budget_text(c), "chosen": c.chosen,
        "figures": records(tables.figures), "scenarios": records(tables.scenarios),
        "interquartile_means": records(tables.means), "duels": records(tables.paired),
        "seeds": records(tables.seeds), "trade": records(tables.trade_off), "life": records(tables.life),
        "bars": [each.as_record() for each in tables.criteria], "lost": tables.lost,
    }  # fmt: skip
    write_json(out / RESULTS_FILE, content)
    parts = _parts(c, tables)
    write_text(out / TABLES_FILE, "\n\n".join(f"# {name}\n\n{text}" for name, text in parts.items()))
    for page in pages:
        fill(page, parts)
    return parts["results"]


def _parts(c: ComparisonResults, tables: ComparisonTables) -> dict[str, str]:
    """The text of each of PARTS."""
    against_rivals = (NOBODY, NOBODY)
    if tables.ours is not None:
        against_rivals = (
            markdown_tables.criteria_table(tables.criteria, tables.lost),
            markdown_tables.paired_comparison_tables(tables.paired) + _image(PAIRED),
        )
    texts = (
        markdown_tables.results_table(tables.figures),
        markdown_tables.short_table(tables.figures),
        *against_rivals,
        markdown_tables.iqm_table(tables.means) + _image(MEANS),
        markdown_tables.trade_off_table(tables.trade_off),
        markdown_tables.life_table(tables.life),
        markdown_tables.scenario_table(c.scenarios),
        markdown_tables.budget_text(c),
        markdown_tables.episodes_text(c) + _image(SCENARIO_MAPS),
        markdown_tables.seeds_table(tables.seeds, RIVAL),
    )
    return dict(zip(PARTS, texts, strict=True))


def _image(name: str) -> str:
    """A figure as Markdown, beneath a text."""
    return f"\n\n![{name}](../images/{name}.png)"


def write_figures(
    c: ComparisonResults,
    tables: ComparisonTables,
    *,
    traces: Mapping[str, Trace],
    curves: Mapping[str, pd.DataFrame],
    out: Path,
    images: Path | None,
) -> None:
    """Write every figure into `out`, and copies into `images`.

    traces: the same episode under each contender. curves: learning curve of each training seed.
    """
    metrics = {(plants, e.name): c.metrics(e.name, plants) for plants in PLANTS for e in c.contenders}
    common = Comparison(table=tables.figures, metrics=metrics, traces=dict(traces))
    plots.excursion_distribution(common, out / "excursions.png")
    plots.episode_overlay(common.traces, out / "episode.png")
    names = ["excursions", "episode"]
    for name, figure in _drawn(tables, curves):
        plots.save_figure(figure, out / f"{name}.png")
        names.append(name)
    if images is None:
        return
    for name in names:
        write_bytes(images / f"{name}.png", (out / f"{name}.png").read_bytes())


def _drawn(tables: ComparisonTables, curves: Mapping[str, pd.DataFrame]) -> Iterator[tuple[str, Figure]]:
    """The figures of the tables by name."""
    yield SCENARIO_MAPS, comparison_figures.scenario_maps(tables.scenarios, TRADE_OFF_ON)
    yield MEANS, comparison_figures.aggregate(tables.means)
    yield "tradeoff", comparison_figures.trade_off_figure(tables.trade_off)
    if tables.ours is not None:
        ours = tables.ours.name
        against = tables.paired.query("ours == @ours")
        yield PAIRED, comparison_figures.paired_comparison_figure(against, ours)
    if curves:
        yield "learning_curve", comparison_figures.learning_curves(curves)
