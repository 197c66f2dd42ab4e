"""How far the ranking of pairs can be trusted: made-up tables of two known causes are ranked."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.common.results_folder import progress
from identification.recordings.recording import OUTPUTS
from identification.studies.error_tables.pairs import (
    candidate_pair_misfits,
    cause_probabilities,
    excess_squares,
)
from identification.studies.error_tables.predicted_tables import PredictedTables
from identification.studies.error_tables.settings import DEFAULTS, ErrorTableSettings


@dataclass(frozen=True, kw_only=True)
class RankingReliability:
    """How often the ranking finds the causes of made-up tables."""

    kernel_width: float
    """Kernel width [-] with the best logarithmic score of the true cause of the current's error."""
    current_cause_first: float
    """Share of tables whose cause of the current's error is among the two most probable [-]."""
    current_cause_in_set: float
    """Share of tables where this cause is in the smallest set that holds 90 % of the probability [-]."""
    pressure_cause_in_set: float
    """The same for the cause of the pressures' errors [-]."""
    tables: int
    """Number of made-up tables [-]."""


@dataclass(frozen=True, kw_only=True)
class KnownTable:
    """A made-up table of two known causes."""

    errors: NDArray
    """Tables 13 and 15 [%], (5 tests, 3 outputs)."""
    draw: int
    """Index of its set of conditions."""
    current_cause: int
    """Index of the cause of most of the current's error."""
    pressure_cause: int
    """Index of the other cause."""


def ranking_reliability(
    tables: PredictedTables,
    scatter: float,
    *,
    n: int,
    seed: int,
    settings: ErrorTableSettings = DEFAULTS,
) -> RankingReliability:
    """Rank n made-up tables.

    Args:
        tables: of the candidates that can be one of a pair.
        scatter: relative scatter of every error [-], as two causes leave it in the printed table.
        n: number of made-up tables.
        seed: of the made-up tables.
        settings: widths, sizes and counts.

    Raises:
        ValueError: no two candidates give errors of the printed size.
    """
    rng = np.random.default_rng(seed)
    known = [_known_table(tables, scatter, rng, settings) for _ in range(n)]
    probabilities = np.array(
        [_ranked(tables, one, rng, settings) for one in progress(known, what="known tables")]
    )
    true = np.array([one.current_cause for one in known])
    likelihood = np.maximum(probabilities[np.arange(n), :, true], settings.probability_floor)
    best_width = int(np.log(likelihood).mean(axis=0).argmax())
    chosen = probabilities[:, best_width]
    sets = [smallest_set(each, settings.set_probability) for each in chosen]
    first = [t in np.argsort(-p)[:2] for t, p in zip(true, chosen, strict=True)]
    in_set = [one.current_cause in s for one, s in zip(known, sets, strict=True)]
    pressure_in_set = [one.pressure_cause in s for one, s in zip(known, sets, strict=True)]
    return RankingReliability(
        kernel_width=settings.kernel_widths[best_width],
        current_cause_first=float(np.mean(first)),
        current_cause_in_set=float(np.mean(in_set)),
        pressure_cause_in_set=float(np.mean(pressure_in_set)),
        tables=n,
    )


def smallest_set(probability: NDArray, content: float = DEFAULTS.set_probability) -> list[int]:
    """Indices of the most probable causes that together hold `content` of all probability.

    probability: of each cause [-], (C,); its sum is arbitrary.
    """
    order: NDArray = np.argsort(-probability)
    share = np.cumsum(probability[order]) / probability.sum()
    return order[: int(np.searchsorted(share, content)) + 1].tolist()


def _known_table(
    tables: PredictedTables, scatter: float, rng: np.random.Generator, settings: ErrorTableSettings
) -> KnownTable:
    """A table of two causes, drawn until its errors are of the printed size."""
    starts, current = tables.starts, OUTPUTS.index("I")
    for _ in range(settings.table_attempts):
        draw = int(rng.integers(len(tables.conditions)))
        excess, least = excess_squares(tables.calibrated[draw])
        pair = rng.choice(len(tables.candidates), 2, replace=False)
        errors = np.sqrt(excess[pair].sum(axis=0) + least).reshape(tables.calibrated.shape[2:])
        causes = [int(np.searchsorted(starts, i, side="right")) - 1 for i in pair]
        if causes[0] != causes[1] and _of_printed_size(errors.max(axis=0), settings):
            order = np.argsort(-excess[pair].reshape(2, *errors.shape)[:, :, current].sum(axis=1))
            return KnownTable(
                errors=errors * np.exp(scatter * rng.standard_normal(errors.shape)),
                draw=draw,
                current_cause=causes[order[0]],
                pressure_cause=causes[order[1]],
            )
    raise ValueError("no two of these causes leave errors like the printed ones: give more causes")


def _of_printed_size(largest: NDArray, settings: ErrorTableSettings) -> bool:
    """Whether the largest errors of the outputs [%], (3,), are of the printed size."""
    current = OUTPUTS.index("I")
    pressures = np.delete(largest, current)
    low, high = settings.current_error_range
    least, most = settings.pressure_error_range
    return bool(low <= largest[current] <= high and np.all((pressures >= least) & (pressures <= most)))


def _ranked(
    tables: PredictedTables, known: KnownTable, rng: np.random.Generator, settings: ErrorTableSettings
) -> Sequence[NDArray]:
    """Probabilities of the causes (C,) for each kernel width, under other conditions than its own."""
    others = np.delete(np.arange(len(tables.conditions)), known.draw)
    draws = rng.choice(others, min(settings.judging_conditions, len(others)), replace=False)
    judging = PredictedTables(
        candidates=tables.candidates,
        conditions=[tables.conditions[draw] for draw in draws],
        calibrated=tables.calibrated[draws],
        initial=tables.initial[draws],
    )
    misfits = candidate_pair_misfits(judging, known.errors)
    return [cause_probabilities(judging, misfits, width) for width in settings.kernel_widths]
