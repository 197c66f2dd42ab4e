"""Tables of a comparison: figures of the aims, interquartile means, paired comparisons, Pareto front."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from epv_env.reward import RewardWeights
from training.evaluation.controller_table import PLANTS, summary_table
from training.evaluation.metrics import EpisodeMetrics, summary
from training.evaluation.scenarios import RANDOM
from training.evaluation.statistics import (
    Estimate,
    bootstrap_estimate,
    paired_difference,
    pareto_front,
    probability_of_improvement,
)
from training.evaluation.switching_life import life_years
from training.studies.comparison.contenders import TRADE_OFF_ON, Contender, Results, chosen_run

SCORES = {
    "excursion_bar": "worst excursion [bar]",
    "breakdown_bar": "largest breakdown [bar]",
    "rms_bar": "rms error [bar]",
    "switchings_per_s": "switchings [1/s]",
    "episode_return": "return",
}
"""Fields of EpisodeMetrics that are averaged over a scenario's episodes and compared."""

HIGHER_IS_BETTER = {"episode_return"}
"""Scores that are better when they are higher; all others are better when they are lower."""

JUDGED_ON = ("calibrated", "sensitive_ten_percent")
"""Plant sets on which all scenarios run."""

LIFE_ON, LIFE_SCENARIOS = "sensitive_ten_percent", ("rest", "service")
"""Plant set and scenarios that the switching life refers to."""

ALL_RUNS = ", all seeds"
"""Ends the name of the row that holds every run of a learned contender."""


@dataclass(frozen=True)
class ComparisonResults:
    """Contenders and the metrics of their episodes."""

    contenders: list[Contender]
    scenarios: list[str]
    results: Results
    variants: list[Contender] = field(default_factory=list)
    """Contenders that were optimised at another price of switching; names as in `contenders`."""

    @cached_property
    def chosen(self) -> dict[str, str]:
        """The run that stands for each contender: of a learned one, that which leaves least often."""
        return {c.name: chosen_run(c, self.results) for c in self.contenders}

    def metrics(self, contender: str, plants: str, scenario: str = RANDOM) -> EpisodeMetrics:
        """Episodes of a contender's chosen run."""
        return self.results[self.chosen[contender], plants, scenario]

    def at_prices(self, contender: Contender) -> dict[float, tuple[str, str]]:
        """By price of switching: the name that a table gives a contender, and its run."""
        own = RewardWeights().switching, (contender.name, self.chosen[contender.name])
        others = [(v.price, run) for v in self.variants if v.name == contender.name for run in v.runs]
        return dict([own, *((price, (run, run)) for price, run in others if price is not None)])

    def scores(self, contender: Contender, plants: str, field: str) -> NDArray:
        """A field of every run, scenario and episode: (runs, scenarios, episodes).

        As many episodes as the scenario with fewest has, the first ones.
        """
        runs = [
            [getattr(self.results[run, plants, scenario], field) for scenario in self.scenarios]
            for run in contender.runs
        ]
        fewest = min(len(values) for run in runs for values in run)
        return np.array([[values[:fewest] for values in run] for run in runs])


def figures(c: ComparisonResults) -> pd.DataFrame:
    """A row per plant set and contender: `summary` of the random scenario.

    A learned contender has two: its chosen run, and all its runs together.
    """
    episodes = {}
    for plants in PLANTS:
        for contender in c.contenders:
            runs = {contender.name: [c.chosen[contender.name]]}
            if len(contender.runs) > 1:
                runs[contender.name + ALL_RUNS] = list(contender.runs)
            for name, members in runs.items():
                parts = [c.results[run, plants, RANDOM] for run in members]
                episodes[plants, name] = EpisodeMetrics.joined(parts)
    return summary_table(episodes)


def by_scenario(c: ComparisonResults) -> pd.DataFrame:
    """A row per plant set of JUDGED_ON, scenario and contender: `summary` of its chosen run."""
    return pd.DataFrame(
        {
            "plants": plants,
            "scenario": scenario,
            "controller": contender.name,
            **summary(c.metrics(contender.name, plants, scenario)),
        }
        for plants in JUDGED_ON
        for scenario in c.scenarios
        for contender in c.contenders
    )


def interquartile_means(c: ComparisonResults) -> pd.DataFrame:
    """A row per plant set, contender and score: interquartile mean over runs and scenarios."""
    return _rows(
        {
            "plants": plants, "controller": contender.name, "score": field,
            **_named("value", bootstrap_estimate(c.scores(contender, plants, field))),
        }
        for plants in JUDGED_ON
        for contender in c.contenders
        for field in SCORES
    )  # fmt: skip


def paired_comparisons(c: ComparisonResults, ours: Contender) -> pd.DataFrame:
    """A row per plant set, rival and score: ours against the rival, paired by episode.

    A rival that has learned too is its chosen run: its training seeds have nothing to do with ours.
    Columns: ours, plants, rival, score; difference (ours - rival's) and probability that ours is better,
    each with its interval.
    """
    return _rows(
        {
            "ours": ours.name,
            "plants": plants,
            "rival": rival.name,
            "score": field,
            **_paired_comparison(c, ours, rival, plants, field),
        }
        for plants in JUDGED_ON
        for rival in (_represented(c, other) for other in c.contenders if other is not ours)
        for field in SCORES
    )  # fmt: skip


def _represented(c: ComparisonResults, contender: Contender) -> Contender:
    """The contender with its chosen run alone."""
    run = c.chosen[contender.name]
    return replace(contender, runs={run: contender.runs[run]})


def _paired_comparison(
    c: ComparisonResults, ours: Contender, rival: Contender, plants: str, field: str
) -> dict[str, float]:
    """Difference and probability of improvement of one score, with their intervals."""
    pair = c.scores(ours, plants, field), c.scores(rival, plants, field)
    lower = field not in HIGHER_IS_BETTER
    difference = paired_difference(*pair)
    better = probability_of_improvement(*pair, lower_is_better=lower)
    return _named("difference", difference) | _named("better", better)


def _named(name: str, of: Estimate) -> dict[str, float]:
    """An estimate as columns."""
    return {name: of.value, f"{name}_low": of.low, f"{name}_high": of.high}


def _rows(rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    """A table of rows that are made one by one."""
    return pd.DataFrame(list(rows))


SEED_SCORES = {
    "rms_bar": ("rms error [mbar]", 1e3),
    "event_breakdown_bar": ("breakdown per event [mbar]", 1e3),
    "switchings_per_s": ("switchings [1/s]", 1.0),
    "episode_return": ("return", 1.0),
}
"""Fields of EpisodeMetrics in which each training seed is set against a rival: heading and factor."""


def seed_differences(c: ComparisonResults, ours: Contender, rival: str) -> pd.DataFrame:
    """A row per run of ours: run - rival in the random episodes on TRADE_OFF_ON, paired by episode.

    Columns: run; episodes; left and rival_left, how many of them left the band; each of SEED_SCORES with
    its interval.
    """
    its = c.metrics(rival, TRADE_OFF_ON)
    return _rows(_seed_difference(run, c.results[run, TRADE_OFF_ON, RANDOM], its) for run in ours.runs)


def _seed_difference(run: str, own: EpisodeMetrics, its: EpisodeMetrics) -> dict[str, Any]:
    fewest = min(len(own), len(its))
    left, rival_left = (int((~each.stayed[:fewest]).sum()) for each in (own, its))
    row: dict[str, Any] = {"run": run, "episodes": fewest, "left": left, "rival_left": rival_left}
    for score in SEED_SCORES:
        pair = (getattr(each, score)[None, None] for each in (own, its))
        row |= _named(score, paired_difference(*pair))
    return row


def switching_life(c: ComparisonResults) -> pd.DataFrame:
    """A row per contender: switchings per second at rest and in service, and the life [years].

    On LIFE_ON; empty if the comparison lacks one of the two scenarios.
    """
    rows = []
    for contender in c.contenders if set(LIFE_SCENARIOS) <= set(c.scenarios) else []:
        rest, service = (
            float(np.mean(c.metrics(contender.name, LIFE_ON, scenario).switchings_per_s))
            for scenario in LIFE_SCENARIOS
        )
        years = life_years(at_rest=rest, in_service=service)
        rows.append(
            {"controller": contender.name, "at_rest": rest, "in_service": service, "years": years}
        )
    return pd.DataFrame(rows)


FRONT = {
    "C1_tail_excursion_bar": "excursion that 99.9 % do not exceed [bar]",
    "C2_largest_breakdown_bar": "largest breakdown [bar]",
    "rms_error_bar": "rms error [bar]",
}
"""Figures that are set against the switchings."""


def trade_off(c: ComparisonResults, episodes: int) -> pd.DataFrame:
    """A row per contender and variant: `summary` of the first episodes on TRADE_OFF_ON, and the front.

    FIGURE_on_front: no other row is as good in the figure and in switchings, and better in one of them;
    a contender with privileged information is a limit, and not on it.
    """
    rows, fair = [], []
    for contender in [*c.contenders, *c.variants]:
        run = c.chosen[contender.name] if contender.price is None else next(iter(contender.runs))
        episodes_run = c.results[run, TRADE_OFF_ON, RANDOM].first(episodes)
        price = RewardWeights().switching if contender.price is None else contender.price
        rows.append({"controller": contender.name, "switching_price": price, **summary(episodes_run)})
        fair.append(not contender.privileged)
    table = pd.DataFrame(rows)
    for column in FRONT:
        rivals = table.loc[fair]
        table[f"{column}_on_front"] = False
        table.loc[fair, f"{column}_on_front"] = pareto_front(
            zip(rivals["switchings_per_s"], rivals[column], strict=True)
        )
    return table
