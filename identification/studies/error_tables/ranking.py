"""How well each cause alone gives a table of errors, and which causes the table cannot tell apart.

The misfit of two tables is the root mean square of the logarithm of their ratio, over tests and outputs
alike; its exponential is a typical factor. Under each drawn set of test conditions a cause takes the
size that suits it best.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.parameters import table as parameter_table
from identification.recordings.recording import OUTPUTS
from identification.studies.error_tables.candidates import Candidate
from identification.studies.error_tables.predicted_tables import Library

TOLERANCE = 1.75
"""Typical factor up to which errors count as given. The printed error of p2 falls by factors of 2.0 and
1.7 between tests that differ by 10 ms of pulse, which no smooth cause gives."""

SHARE = 0.1
"""Share of the drawn conditions under which a cause must give the table; and in which it must be as near
as the nearest for both to be inseparable."""

NEAR = 1.1
"""Ratio of two typical factors that tells nothing: the steps of the sizes alone move them as much."""

GIVES = "gives the pattern"
CURRENT = "gives only the current's part"
PRESSURES = "gives only the pressures' part"
CANNOT = "cannot"


@dataclass(frozen=True, kw_only=True)
class Match:
    """One cause, or one pair, against one table."""

    cause: str
    factors: NDArray
    """Typical factor under each set of conditions at the size that suits best, (D,)."""
    current: float
    """Greatest typical factor of an output, if the current is to be met and the pressures' errors may
    stay below the table's; at the size for that, median."""
    pressures: float
    """The same with current and pressures exchanged."""
    candidate: Candidate
    """At the size that serves most conditions best; for a part, the one that serves that part."""
    predicted: NDArray
    """Its median predicted errors [%], (tests, outputs)."""
    first: float
    """Share of the conditions under which no other cause comes nearer."""
    before: float
    """Typical factor of Table 11 at that size, median: it was not used to choose it."""
    verdict: str
    reason: str
    """What is missing, or too much."""

    @property
    def median(self) -> float:
        """Typical factor under usual conditions."""
        return float(np.median(self.factors))

    @property
    def interval(self) -> tuple[float, float]:
        """Typical factors between which 80 % of the conditions lie."""
        low, high = np.quantile(self.factors, [0.1, 0.9])
        return float(low), float(high)


def misfits(errors: NDArray, table: NDArray) -> NDArray:
    """Root mean square of ln(errors / table), (D, n), for errors (D, n, tests, outputs)."""
    return np.sqrt(np.mean(np.log(errors / table) ** 2, axis=(2, 3)))


def part_misfits(errors: NDArray, table: NDArray, wanted: Sequence[str]) -> NDArray:
    """Misfit of the worst output, (D, n); outputs that are not wanted count where they are too large."""
    ratio = np.log(errors / table)
    for index, output in enumerate(OUTPUTS):
        if output not in wanted:
            ratio[..., index] = np.maximum(ratio[..., index], 0.0)
    return np.sqrt(np.mean(ratio**2, axis=2)).max(axis=-1)


def matches(library: Library, after: NDArray, before: NDArray | None = None) -> list[Match]:
    """Every cause against Tables 13 and 15 (and 11), the nearest first."""
    whole = misfits(library.after, after)
    parts = [part_misfits(library.after, after, wanted) for wanted in (("I",), ("p2", "p3"))]
    best = np.minimum.reduceat(whole, library.starts, axis=1)
    first = np.mean(best == best.min(axis=1, keepdims=True), axis=0)
    ends = [*library.starts, len(library.candidates)]
    found = []
    for index in range(len(library.causes)):
        own = slice(ends[index], ends[index + 1])
        three = [misfit[:, own] for misfit in (whole, *parts)]
        found.append(_match(library, (after, before), own, three, float(first[index])))
    return sorted(found, key=lambda match: match.median)


def inseparable(found: Sequence[Match]) -> list[str]:
    """The nearest cause, and those that are as near, or are so under some of the conditions."""
    best = found[0]
    return [
        m.cause
        for m in found
        if m.median <= NEAR * best.median or np.mean(m.factors <= best.factors) >= SHARE
    ]


def _match(
    library: Library,
    tables: tuple[NDArray, NDArray | None],
    own: slice,
    misfit: Sequence[NDArray],
    first: float,
) -> Match:
    factors, current, pressures = (np.exp(each.min(axis=1)) for each in misfit)
    verdict = _verdict(factors, current, pressures)
    chosen = int(np.median(misfit[{CURRENT: 1, PRESSURES: 2}.get(verdict, 0)], axis=0).argmin())
    predicted = np.median(library.after[:, own][:, chosen], axis=0)
    candidate = library.candidates[own][chosen]
    after, before = tables
    earlier = np.nan if before is None else np.median(misfits(library.before[:, own], before)[:, chosen])
    return Match(
        cause=candidate.cause, factors=factors, current=float(np.median(current)),
        pressures=float(np.median(pressures)), candidate=candidate, predicted=predicted, first=first,
        before=float(np.exp(earlier)), verdict=verdict, reason=_reason(predicted, after, candidate),
    )  # fmt: skip


def _verdict(factors: NDArray, current: NDArray, pressures: NDArray) -> str:
    for verdict, found in ((GIVES, factors), (CURRENT, current), (PRESSURES, pressures)):
        if np.mean(found <= TOLERANCE) >= SHARE:
            return verdict
    return CANNOT


def _reason(predicted: NDArray, table: NDArray, candidate: Candidate) -> str:
    """How the predicted errors of each output compare with the table's."""
    ratio = np.exp(np.mean(np.log(predicted / table), axis=0))
    words = [f"{output} ×{value:.2g}" for output, value in zip(OUTPUTS, ratio, strict=True)]
    return ", ".join(words) + (" at the end of its range" if at_the_end(candidate) else "")


def at_the_end(candidate: Candidate) -> bool:
    """Whether a size lies at an end of its physical range."""
    return any(
        value in (parameter_table()[symbol].domain or ()) and value != 0.0
        for symbol, value in candidate.changes.items()
    )
