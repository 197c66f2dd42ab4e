"""How well each cause alone explains a table of errors, and which causes the table cannot separate.

The misfit of two tables is the root mean square of the logarithm of their ratio, over tests and outputs
alike; its exponential is a typical factor. Under each set of test conditions a cause takes the size that
suits it best.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.parameters import table as parameter_table
from identification.recordings.recording import OUTPUTS
from identification.studies.error_tables.candidates import Candidate
from identification.studies.error_tables.predicted_tables import PredictedTables
from identification.studies.error_tables.settings import DEFAULTS, ErrorTableSettings

EXPLAINS_ALL = "gives the pattern"
EXPLAINS_CURRENT = "gives only the current's part"
EXPLAINS_PRESSURES = "gives only the pressures' part"
EXPLAINS_NOTHING = "cannot"
"""Verdicts, as in tables.json."""


@dataclass(frozen=True, kw_only=True)
class CauseMatch:
    """One cause, or one pair of causes, against the printed tables; D sets of conditions."""

    cause: str
    """Name of the cause; a pair's names are joined by ' + '."""
    factors: NDArray
    """Typical factor under each set of conditions at the size that suits best [-], (D,)."""
    median: float
    """Median of the typical factors [-]."""
    interval: tuple[float, float]
    """Typical factors between which 80 % of the conditions lie [-]."""
    current_factor: float
    """Largest typical factor of an output if only the current has to be met and the pressures' errors
    may stay below the table's [-]; median at the size that suits this best."""
    pressure_factor: float
    """The same with current and pressures exchanged [-]."""
    candidate: Candidate
    """The size that suits most conditions best; for a part of the pattern, the size that suits it."""
    predicted: NDArray
    """Median predicted errors of this candidate [%], (5 tests, 3 outputs)."""
    share_nearest: float
    """Share of the conditions under which no other cause comes nearer [-]."""
    initial_factor: float
    """Typical factor of Table 11 at this size, median [-]; nan without Table 11. It does not influence
    the choice of the size."""
    verdict: str
    """EXPLAINS_ALL, EXPLAINS_CURRENT, EXPLAINS_PRESSURES or EXPLAINS_NOTHING."""
    error_ratios: str
    """Predicted over printed errors of each output, ready to read."""


@dataclass(frozen=True, kw_only=True)
class _Misfits:
    """Misfits of the m candidates of one cause [-], (D, m)."""

    all: NDArray
    current: NDArray
    pressures: NDArray

    def verdict(self, settings: ErrorTableSettings) -> str:
        """The largest part of the pattern that the cause explains under enough conditions."""
        parts = (
            (EXPLAINS_ALL, self.all),
            (EXPLAINS_CURRENT, self.current),
            (EXPLAINS_PRESSURES, self.pressures),
        )
        for verdict, misfit in parts:
            explained = np.exp(misfit.min(axis=1)) <= settings.tolerance
            if np.mean(explained) >= settings.condition_share:
                return verdict
        return EXPLAINS_NOTHING

    def of(self, verdict: str) -> NDArray:
        """Misfits of the part that the verdict is about."""
        parts = {EXPLAINS_CURRENT: self.current, EXPLAINS_PRESSURES: self.pressures}
        return parts.get(verdict, self.all)


def table_misfits(errors: NDArray, table: NDArray) -> NDArray:
    """Root mean square of ln(errors / table) [-], (D, n).

    errors: (D, n, tests, outputs) [%]. table: (tests, outputs) [%].
    """
    return np.sqrt(np.mean(np.log(errors / table) ** 2, axis=(2, 3)))


def part_misfits(errors: NDArray, table: NDArray, outputs: Sequence[str]) -> NDArray:
    """Misfit of the worst output [-], (D, n); other outputs than `outputs` count if too large only.

    errors: (D, n, tests, outputs) [%]. table: (tests, outputs) [%].
    """
    ratio = np.log(errors / table)
    for index, output in enumerate(OUTPUTS):
        if output not in outputs:
            ratio[..., index] = np.maximum(ratio[..., index], 0.0)
    return np.sqrt(np.mean(ratio**2, axis=2)).max(axis=-1)


def ranked_causes(
    tables: PredictedTables,
    calibrated: NDArray,
    initial: NDArray | None = None,
    settings: ErrorTableSettings = DEFAULTS,
) -> list[CauseMatch]:
    """Every cause against the printed tables, the nearest first.

    Args:
        tables: predicted tables of every cause.
        calibrated: Tables 13 and 15 [%], (5 tests, 3 outputs).
        initial: Table 11 [%], (4 tests, 3 outputs).
        settings: of the ranking.
    """
    misfits = _Misfits(
        all=table_misfits(tables.calibrated, calibrated),
        current=part_misfits(tables.calibrated, calibrated, ("I",)),
        pressures=part_misfits(tables.calibrated, calibrated, ("p2", "p3")),
    )
    best = np.minimum.reduceat(misfits.all, tables.starts, axis=1)
    nearest = np.mean(best == best.min(axis=1, keepdims=True), axis=0)
    ends = [*tables.starts, len(tables.candidates)]
    matches = []
    for index in range(len(tables.causes)):
        own = slice(ends[index], ends[index + 1])
        parts = _Misfits(
            all=misfits.all[:, own],
            current=misfits.current[:, own],
            pressures=misfits.pressures[:, own],
        )
        share = float(nearest[index])
        matches.append(_match(tables, own, parts, share, calibrated, initial, settings))
    return sorted(matches, key=lambda match: match.median)


def inseparable_causes(
    matches: Sequence[CauseMatch], settings: ErrorTableSettings = DEFAULTS
) -> list[str]:
    """The nearest cause, and those as near in the median or under enough of the conditions.

    matches: the nearest first.
    """
    best = matches[0]
    return [
        match.cause
        for match in matches
        if match.median <= settings.inseparable_ratio * best.median
        or np.mean(match.factors <= best.factors) >= settings.condition_share
    ]


def _match(
    tables: PredictedTables,
    own: slice,
    misfits: _Misfits,
    share_nearest: float,
    calibrated: NDArray,
    initial: NDArray | None,
    settings: ErrorTableSettings,
) -> CauseMatch:
    """The match of the cause whose candidates are `own`."""
    verdict = misfits.verdict(settings)
    chosen = int(np.median(misfits.of(verdict), axis=0).argmin())
    predicted = np.median(tables.calibrated[:, own][:, chosen], axis=0)
    candidate = tables.candidates[own][chosen]
    factors = np.exp(misfits.all.min(axis=1))
    low, high = np.quantile(factors, settings.interval_quantiles)
    return CauseMatch(
        cause=candidate.cause,
        factors=factors,
        median=float(np.median(factors)),
        interval=(float(low), float(high)),
        current_factor=float(np.median(np.exp(misfits.current.min(axis=1)))),
        pressure_factor=float(np.median(np.exp(misfits.pressures.min(axis=1)))),
        candidate=candidate,
        predicted=predicted,
        share_nearest=share_nearest,
        initial_factor=_initial_factor(tables.initial[:, own], chosen, initial),
        verdict=verdict,
        error_ratios=_error_ratios(predicted, calibrated, candidate),
    )


def _initial_factor(errors: NDArray, chosen: int, table: NDArray | None) -> float:
    """Median typical factor of Table 11 at the chosen candidate [-]; nan without the table."""
    if table is None:
        return float("nan")
    return float(np.exp(np.median(table_misfits(errors, table)[:, chosen])))


def _error_ratios(predicted: NDArray, table: NDArray, candidate: Candidate) -> str:
    """Predicted over printed errors of each output, geometric mean over the tests."""
    ratio = np.exp(np.mean(np.log(predicted / table), axis=0))
    words = [f"{output} ×{value:.2g}" for output, value in zip(OUTPUTS, ratio, strict=True)]
    return ", ".join(words) + (" at the end of its range" if at_range_end(candidate) else "")


def at_range_end(candidate: Candidate) -> bool:
    """Whether a size lies at an end of its physical range."""
    return any(
        value in (parameter_table()[symbol].domain or ()) and value != 0.0
        for symbol, value in candidate.changes.items()
    )
