"""Writing a comparison: results.json, tables.md, figures, and the generated parts of pages."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from epv_env.common.files import write_bytes, write_text
from training.evaluation import plots
from training.evaluation.controller_table import PLANTS, Comparison
from training.evaluation.rollout import Trace
from training.studies.comparison import figures as draw
from training.studies.comparison import report, scores
from training.studies.comparison.acceptance_criteria import Bar, bars, lost
from training.studies.comparison.plan import TRADED_ON, Contender
from training.studies.comparison.scores import Contest, records
from training.studies.page_parts import fill

RESULTS_FILE, TABLES_FILE = "results.json", "tables.md"

PARTS = (
    "results", "short", "bars", "duels", "means", "trade", "scenarios", "tuning", "episodes"
)  # fmt: skip
"""Generated parts that a page can ask for."""

SCENARIO_MAPS, MEANS, DUELS = "comparison-scenarios", "comparison-means", "comparison-duels"
"""Names of the figures that generated parts show, as pages beside the folder `images` find them."""

NOBODY = "No learned controller took part in this comparison."


@dataclass(frozen=True, kw_only=True)
class Findings:
    """Everything that is said about a comparison."""

    figures: pd.DataFrame
    scenarios: pd.DataFrame
    means: pd.DataFrame
    traded: pd.DataFrame
    ours: Contender | None
    """The first learned contender, if one takes part."""
    duels: pd.DataFrame
    bars: list[Bar]
    lost: list[dict[str, str | float]]


def findings(c: Contest, *, trade_episodes: int) -> Findings:
    """Compute all tables. trade_episodes: so many, the first, are the trade-off's."""
    learned = [each for each in c.contenders if each.learned]
    ours = learned[0] if learned else None
    return Findings(
        figures=scores.figures(c),
        scenarios=scores.by_scenario(c),
        means=scores.interquartile_means(c),
        traded=scores.trade(c, trade_episodes),
        ours=ours,
        duels=pd.DataFrame() if ours is None else scores.duels(c, ours),
        bars=[bar for each in learned for bar in bars(c, each)],
        lost=[] if ours is None else lost(c, ours),
    )


def write_tables(
    c: Contest, found: Findings, *, settings: Mapping[str, Any], out: Path, pages: Sequence[Path]
) -> str:
    """Write results.json, tables.md and the pages' generated parts; return the main table.

    settings: what was asked for, kept in results.json.
    """
    content: dict[str, Any] = {
        "settings": dict(settings), "tuning": report.budget_text(c), "chosen": c.chosen,
        "figures": records(found.figures), "scenarios": records(found.scenarios),
        "interquartile_means": records(found.means), "duels": records(found.duels),
        "trade": records(found.traded), "bars": [asdict(bar) for bar in found.bars], "lost": found.lost,
    }  # fmt: skip
    write_text(out / RESULTS_FILE, json.dumps(content, indent=1) + "\n")
    ours = found.ours
    texts = (
        report.results_table(found.figures),
        report.short_table(found.figures),
        NOBODY if ours is None else report.bar_table(found.bars, found.lost),
        NOBODY if ours is None else report.duel_table(found.duels, ours.name) + _image(DUELS),
        report.iqm_table(found.means) + _image(MEANS),
        report.trade_table(found.traded),
        report.scenario_table(c.scenarios),
        report.budget_text(c),
        report.episodes_text(c) + _image(SCENARIO_MAPS),
    )
    parts: dict[str, str] = dict(zip(PARTS, texts, strict=True))
    write_text(out / TABLES_FILE, "\n\n".join(f"# {name}\n\n{text}" for name, text in parts.items()))
    for page in pages:
        fill(page, parts)
    return parts["results"]


def _image(name: str) -> str:
    """A figure as Markdown, beneath a text."""
    return f"\n\n![{name}](images/{name}.png)"


def write_figures(
    c: Contest,
    found: Findings,
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
    common = Comparison(table=found.figures, metrics=metrics, traces=dict(traces))
    plots.excursion_distribution(common, out / "excursions.png")
    plots.episode_overlay(common.traces, out / "episode.png")
    names = ["excursions", "episode"]
    for name, figure in _drawn(found, curves):
        plots.save_figure(figure, out / f"{name}.png")
        names.append(name)
    if images is None:
        return
    for name in names:
        write_bytes(images / f"{name}.png", (out / f"{name}.png").read_bytes())


def _drawn(found: Findings, curves: Mapping[str, pd.DataFrame]) -> Iterator[tuple[str, Figure]]:
    """The figures of the tables by name."""
    yield SCENARIO_MAPS, draw.scenario_maps(found.scenarios, TRADED_ON)
    yield MEANS, draw.aggregate(found.means)
    yield "tradeoff", draw.trade_figure(found.traded)
    if found.ours is not None:
        yield DUELS, draw.duel_figure(found.duels, found.ours.name)
    if curves:
        yield "learning_curve", draw.learning_curves(curves)
