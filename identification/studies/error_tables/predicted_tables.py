"""The tables that every cause would have given at every size, under many drawn test conditions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.common.results_folder import progress
from identification.studies.error_tables.bench_conditions import Conditions
from identification.studies.error_tables.candidates import Candidate
from identification.studies.error_tables.error_prediction import predicted_errors
from identification.studies.error_tables.settings import DEFAULTS, ErrorTableSettings


@dataclass(frozen=True, kw_only=True)
class PredictedTables:
    """Predicted Tables 11, 13 and 15 of n candidates of C causes under D sets of conditions."""

    candidates: list[Candidate]
    """The n candidates; those of a cause stand together."""
    conditions: list[Conditions]
    """The D sets of conditions."""
    calibrated: NDArray
    """Tables 13 and 15 [%], (D, n, 5 tests, 3 outputs)."""
    initial: NDArray
    """Table 11 [%], (D, n, 4 tests, 3 outputs)."""

    @property
    def causes(self) -> list[str]:
        """The C causes, each once, in order."""
        return list(dict.fromkeys(candidate.cause for candidate in self.candidates))

    @property
    def starts(self) -> NDArray:
        """Index of each cause's first candidate, (C,)."""
        names = [candidate.cause for candidate in self.candidates]
        return np.array([names.index(cause) for cause in self.causes])


def simulated_tables(
    candidates: Sequence[Candidate],
    conditions: Sequence[Conditions],
    label: str,
    settings: ErrorTableSettings = DEFAULTS,
) -> PredictedTables:
    """Simulate every candidate under all conditions, and fit the model to each. label: of progress."""
    predictions = [
        predicted_errors(one, [candidate.valve(one) for candidate in candidates], settings)
        for one in progress(conditions, what=label)
    ]
    limit = settings.error_limit
    return PredictedTables(
        candidates=list(candidates),
        conditions=list(conditions),
        calibrated=np.minimum([one.calibrated for one in predictions], limit),
        initial=np.minimum([one.initial for one in predictions], limit),
    )


def refined_tables(tables: PredictedTables) -> PredictedTables:
    """The tables with a size added between each two of one parameter.

    The errors of an added size are the geometric means of its neighbours' errors.
    """
    candidates: list[Candidate] = []
    columns: list[tuple[int, int]] = []
    for i, candidate in enumerate(tables.candidates):
        between = tables.candidates[i - 1].halfway(candidate) if i else None
        if between is not None:
            candidates.append(between)
            columns.append((i - 1, i))
        candidates.append(candidate)
        columns.append((i, i))
    near, far = np.array(columns).T
    return PredictedTables(
        candidates=candidates,
        conditions=tables.conditions,
        calibrated=np.sqrt(tables.calibrated[:, near] * tables.calibrated[:, far]),
        initial=np.sqrt(tables.initial[:, near] * tables.initial[:, far]),
    )


def selected_tables(tables: PredictedTables, keep: NDArray) -> PredictedTables:
    """The tables of some candidates. keep: indices in increasing order, (m,)."""
    return PredictedTables(
        candidates=[tables.candidates[i] for i in keep],
        conditions=tables.conditions,
        calibrated=tables.calibrated[:, keep],
        initial=tables.initial[:, keep],
    )
