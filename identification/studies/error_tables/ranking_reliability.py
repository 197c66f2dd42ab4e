"""How far the ranking can be trusted: tables made of two known causes, under unknown conditions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.common.progress import progress
from identification.recordings.recording import OUTPUTS
from identification.studies.error_tables.pairs import all_misfits, probabilities, summed
from identification.studies.error_tables.predicted_tables import Library

WIDTHS = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4)
"""Widths of the kernel that are tried."""

CURRENT, PRESSURE = (3.0, 12.0), (0.8, 6.0)
"""Between these lie the greatest errors of I, and of p2 and p3, of a made-up table [%]."""

MOST_TRIES = 100_000

OTHERS = 3
"""Sets of conditions by which a made-up table is judged, its own not among them."""


@dataclass(frozen=True, kw_only=True)
class Trust:
    """What came of ranking pairs for tables whose causes are known."""

    width: float
    """Width of the kernel under which the true causes of the current's error are the most probable."""
    first: float
    """Share of tables whose cause of the current's error came out among the two most probable causes."""
    within: float
    """Share of tables where it was in the smallest set that holds 90 % of the probability."""
    second: float
    """The same for the cause of the pressures' errors."""
    n: int
    """Number of tables."""


@dataclass(frozen=True, kw_only=True)
class Twin:
    """A made-up table, its draw, and its causes by index: of the current's, of the pressures' errors."""

    table: NDArray
    draw: int
    causes: tuple[int, int]


def trust(library: Library, scatter: float, *, n: int, seed: int) -> Trust:
    """Rank n made-up tables. scatter: relative, of every figure, as two causes leave it unexplained."""
    rng = np.random.default_rng(seed)
    twins = [_twin(library, scatter, rng) for _ in range(n)]
    found = np.array([_ranked(library, twin, rng) for twin in progress(twins, what="known tables")])
    true = np.array([twin.causes[0] for twin in twins])
    score = np.log(np.maximum(found[np.arange(n), :, true], 1e-6)).mean(axis=0)
    chosen = found[:, int(score.argmax())]
    sets = [smallest_set(probability) for probability in chosen]
    return Trust(
        width=WIDTHS[int(score.argmax())],
        first=float(np.mean([t in np.argsort(-p)[:2] for t, p in zip(true, chosen, strict=True)])),
        within=float(np.mean([t.causes[0] in s for t, s in zip(twins, sets, strict=True)])),
        second=float(np.mean([t.causes[1] in s for t, s in zip(twins, sets, strict=True)])),
        n=n,
    )


def smallest_set(probability: NDArray, content: float = 0.9) -> list[int]:
    """Indices of the most probable causes that together hold `content` of all probability."""
    order: NDArray = np.argsort(-probability)
    share = np.cumsum(probability[order]) / probability.sum()
    return order[: int(np.searchsorted(share, content)) + 1].tolist()


def _twin(library: Library, scatter: float, rng: np.random.Generator) -> Twin:
    """A table like the printed one: drawn until its errors are of that order."""
    starts, current = library.starts, OUTPUTS.index("I")
    for _ in range(MOST_TRIES):
        draw = int(rng.integers(len(library.conditions)))
        excess, floor = summed(library.after[draw])
        pair = rng.choice(len(library.candidates), 2, replace=False)
        table = np.sqrt(excess[pair].sum(axis=0) + floor).reshape(library.after.shape[2:])
        causes = [int(np.searchsorted(starts, i, side="right")) - 1 for i in pair]
        greatest = table.max(axis=0)
        if causes[0] != causes[1] and _like_printed(greatest, current):
            order = np.argsort(-excess[pair].reshape(2, *table.shape)[:, :, current].sum(axis=1))
            noisy = table * np.exp(scatter * rng.standard_normal(table.shape))
            return Twin(table=noisy, draw=draw, causes=(causes[order[0]], causes[order[1]]))
    raise ValueError("no two of these causes leave errors like the printed ones: give more causes")


def _like_printed(greatest: NDArray, current: int) -> bool:
    pressures = np.delete(greatest, current)
    return bool(
        CURRENT[0] <= greatest[current] <= CURRENT[1]
        and np.all((pressures >= PRESSURE[0]) & (pressures <= PRESSURE[1]))
    )


def _ranked(library: Library, twin: Twin, rng: np.random.Generator) -> Sequence[NDArray]:
    """Probabilities of the causes for each width."""
    others = np.delete(np.arange(len(library.conditions)), twin.draw)
    draws = rng.choice(others, min(OTHERS, len(others)), replace=False)
    judged = Library(
        candidates=library.candidates,
        conditions=[library.conditions[draw] for draw in draws],
        after=library.after[draws],
        before=library.before[draws],
    )
    misfit = all_misfits(judged, twin.table)
    return [probabilities(judged, misfit, width) for width in WIDTHS]
