"""Two causes at once. The errors of independent causes add in squares; the nearest pairs are simulated.

The probability of a cause to be one of the two is that of a table near the given one (approximate
Bayesian computation): all pairs of causes alike beforehand, all tried sizes of a cause alike, all drawn
conditions alike. How near is near is settled with tables whose causes are known (trust.py).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.studies.error_tables.candidates import NONE, Candidate
from identification.studies.error_tables.predicted_tables import Library, only, simulated
from identification.studies.error_tables.ranking import Match, matches

CHECKED = 12
"""Pairs that are simulated."""

LARGE = 30.0
"""A cause that alone gives an error above this is no half of a pair [%]."""


def usable(library: Library) -> Library:
    """The candidates that can be half of a pair."""
    small = np.max(library.after, axis=(0, 2, 3)) <= LARGE
    named = np.array([candidate.cause != NONE for candidate in library.candidates])
    return only(library, np.flatnonzero(small & named))


def nearest(library: Library, misfit: NDArray) -> NDArray:
    """Misfit of each pair of causes, median over conditions of the best sizes, (C, C), from misfits
    (D, n, n)."""
    best = np.median(_per_cause(misfit, library.starts, np.minimum), axis=0)
    np.fill_diagonal(best, np.inf)
    return best


def probabilities(library: Library, misfit: NDArray, width: float) -> NDArray:
    """Probability of each cause to be one of the two, (C,), from misfits (D, n, n)."""
    near = np.exp(-0.5 * (misfit**2 - misfit.min() ** 2) / width**2)
    sizes = np.diff([*library.starts, len(library.candidates)])
    weight = _per_cause(near, library.starts, np.add).mean(axis=0) / np.outer(sizes, sizes)
    np.fill_diagonal(weight, 0.0)
    return 2.0 * weight.sum(axis=0) / weight.sum()


def all_misfits(library: Library, table: NDArray) -> NDArray:
    """Misfit of each two candidates under each set of conditions, (D, n, n)."""
    draws = range(len(library.conditions))
    return np.stack([_misfits(library.after[draw], table) for draw in draws])


def checked(library: Library, misfit: NDArray, after: NDArray, before: NDArray) -> list[Match]:
    """The nearest pairs, at the sizes that serve most conditions best, as simulated together.

    misfit: (D, n, n), against Tables 13 and 15, `after`.
    """
    sizes, best = np.median(misfit, axis=0), nearest(library, misfit)
    upper = np.where(np.triu(np.ones_like(best), 1) > 0, best, np.inf)
    order = np.column_stack(np.unravel_index(np.argsort(upper, axis=None), upper.shape))
    joined = [_joined(library, sizes, a, b) for a, b in order[:CHECKED]]
    return matches(simulated(joined, library.conditions, "pairs of causes"), after, before)


def summed(errors: NDArray) -> tuple[NDArray, NDArray]:
    """Squared errors beyond the least of all candidates', (n, cells), and that least, (cells,)."""
    squares = errors.reshape(len(errors), -1) ** 2
    floor = squares.min(axis=0)
    return squares - floor, floor


def _misfits(errors: NDArray, table: NDArray) -> NDArray:
    """Misfit of each two candidates, (n, n), from their errors (n, tests, outputs).

    The least error of all candidates stands for the sensors' noise, which counts once.
    """
    excess, floor = summed(errors)
    goal = np.log(table.ravel())
    total = np.zeros((len(excess), len(excess)))
    for cell in range(len(floor)):
        both = excess[:, None, cell] + excess[None, :, cell] + floor[cell]
        total += (0.5 * np.log(both) - goal[cell]) ** 2
    return np.sqrt(total / len(floor))


def _per_cause(values: NDArray, starts: NDArray, reduce: np.ufunc) -> NDArray:
    """(D, n, n) -> (D, C, C)."""
    return reduce.reduceat(reduce.reduceat(values, starts, axis=1), starts, axis=2)


def _joined(library: Library, sizes: NDArray, a: int, b: int) -> Candidate:
    ends: Sequence[int] = [*library.starts, len(library.candidates)]
    block = sizes[ends[a] : ends[a + 1], ends[b] : ends[b + 1]]
    i, j = np.unravel_index(block.argmin(), block.shape)
    return library.candidates[ends[a] + int(i)].joined(library.candidates[ends[b] + int(j)])
