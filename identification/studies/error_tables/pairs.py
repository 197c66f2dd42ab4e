"""Two causes at once. The errors of independent causes add in squares; the nearest pairs are simulated.

The probability that a cause is one of the two is that of a table near the printed one (approximate
Bayesian computation). All pairs of causes are equally probable beforehand, and so are all tried sizes
of a cause and all sets of conditions. Tables of known causes give the width of the kernel that says how
near counts as near (ranking_reliability.py).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.studies.error_tables.candidates import NO_CAUSE, Candidate
from identification.studies.error_tables.predicted_tables import (
    PredictedTables,
    selected_tables,
    simulated_tables,
)
from identification.studies.error_tables.ranking import CauseMatch, ranked_causes
from identification.studies.error_tables.settings import DEFAULTS, ErrorTableSettings


def pair_members(tables: PredictedTables, settings: ErrorTableSettings = DEFAULTS) -> PredictedTables:
    """The tables of the candidates that can be one of a pair."""
    small = np.max(tables.calibrated, axis=(0, 2, 3)) <= settings.largest_pair_error
    named = np.array([candidate.cause != NO_CAUSE for candidate in tables.candidates])
    return selected_tables(tables, np.flatnonzero(small & named))


def candidate_pair_misfits(tables: PredictedTables, printed: NDArray) -> NDArray:
    """Misfit of each two candidates under each set of conditions [-], (D, n, n).

    printed: Tables 13 and 15 [%], (5 tests, 3 outputs).
    """
    draws = range(len(tables.conditions))
    return np.stack([_pair_misfits(tables.calibrated[draw], printed) for draw in draws])


def cause_pair_misfits(tables: PredictedTables, misfits: NDArray) -> NDArray:
    """Misfit of each two causes at their best sizes, median over the conditions [-], (C, C).

    misfits: of each two candidates [-], (D, n, n). The diagonal of the result is infinite.
    """
    best = np.median(_per_cause(misfits, tables.starts, np.minimum), axis=0)
    np.fill_diagonal(best, np.inf)
    return best


def cause_probabilities(tables: PredictedTables, misfits: NDArray, kernel_width: float) -> NDArray:
    """Probability that each cause is one of the two [-], (C,); the sum is 2.

    misfits: of each two candidates [-], (D, n, n). kernel_width: of the Gaussian over misfits [-].
    """
    near = np.exp(-0.5 * (misfits**2 - misfits.min() ** 2) / kernel_width**2)
    sizes = np.diff([*tables.starts, len(tables.candidates)])
    weight = _per_cause(near, tables.starts, np.add).mean(axis=0) / np.outer(sizes, sizes)
    np.fill_diagonal(weight, 0.0)
    return 2.0 * weight.sum(axis=0) / weight.sum()


def simulated_pairs(
    tables: PredictedTables,
    misfits: NDArray,
    calibrated: NDArray,
    initial: NDArray,
    settings: ErrorTableSettings = DEFAULTS,
) -> list[CauseMatch]:
    """The nearest pairs at the sizes that suit most conditions best, simulated together.

    Args:
        tables: of the candidates that can be one of a pair.
        misfits: of each two candidates against `calibrated` [-], (D, n, n).
        calibrated: Tables 13 and 15 [%], (5 tests, 3 outputs).
        initial: Table 11 [%], (4 tests, 3 outputs).
        settings: how many pairs are simulated.
    """
    sizes, best = np.median(misfits, axis=0), cause_pair_misfits(tables, misfits)
    upper = np.where(np.triu(np.ones_like(best), 1) > 0, best, np.inf)
    order = np.column_stack(np.unravel_index(np.argsort(upper, axis=None), upper.shape))
    joined = [_joined(tables, sizes, a, b) for a, b in order[: settings.simulated_pairs]]
    simulated = simulated_tables(joined, tables.conditions, "pairs of causes", settings)
    return ranked_causes(simulated, calibrated, initial, settings)


def excess_squares(errors: NDArray) -> tuple[NDArray, NDArray]:
    """Squared errors beyond the least of all candidates [%^2], (n, cells), and the least, (cells,).

    errors: of n candidates [%], (n, ...).
    """
    squares = errors.reshape(len(errors), -1) ** 2
    least = squares.min(axis=0)
    return squares - least, least


def _pair_misfits(errors: NDArray, printed: NDArray) -> NDArray:
    """Misfit of each two candidates [-], (n, n), from their errors [%], (n, tests, outputs).

    The least error of all candidates stands for the sensors' noise, which counts once.
    """
    excess, least = excess_squares(errors)
    goal = np.log(printed.ravel())
    total = np.zeros((len(excess), len(excess)))
    for cell in range(len(least)):
        both = excess[:, None, cell] + excess[None, :, cell] + least[cell]
        total += (0.5 * np.log(both) - goal[cell]) ** 2
    return np.sqrt(total / len(least))


def _per_cause(values: NDArray, starts: NDArray, reduce: np.ufunc) -> NDArray:
    """Values of each two candidates (D, n, n) reduced to each two causes (D, C, C)."""
    return reduce.reduceat(reduce.reduceat(values, starts, axis=1), starts, axis=2)


def _joined(tables: PredictedTables, sizes: NDArray, a: int, b: int) -> Candidate:
    """Causes a and b at their nearest pair of sizes. sizes: misfits of each two candidates, (n, n)."""
    ends: Sequence[int] = [*tables.starts, len(tables.candidates)]
    block = sizes[ends[a] : ends[a + 1], ends[b] : ends[b + 1]]
    i, j = np.unravel_index(block.argmin(), block.shape)
    return tables.candidates[ends[a] + int(i)].joined(tables.candidates[ends[b] + int(j)])
