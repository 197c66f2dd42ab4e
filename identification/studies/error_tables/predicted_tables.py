"""The tables that every cause would have given at every size, under many drawn test conditions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.common.progress import progress
from identification.studies.error_tables.bench_conditions import (
    Conditions,
    drawn_conditions,
    fitted_conditions,
)
from identification.studies.error_tables.candidates import Candidate
from identification.studies.error_tables.patterns import predicted

MOST_ERROR = 1e4
"""Stands for the error of a valve that cannot be integrated [%]."""


@dataclass(frozen=True, kw_only=True)
class Library:
    """Predicted Tables 11, 13 and 15 of n candidates under D conditions."""

    candidates: list[Candidate]
    """Those of a cause stand together."""
    conditions: list[Conditions]
    after: NDArray
    """Errors [%], (D, n, tests, outputs)."""
    before: NDArray
    """Table 11 [%], (D, n, 4, outputs)."""

    @property
    def causes(self) -> list[str]:
        """Names, each once, in order."""
        return list(dict.fromkeys(candidate.cause for candidate in self.candidates))

    @property
    def starts(self) -> NDArray:
        """Where each cause's candidates begin, (C,)."""
        names = [candidate.cause for candidate in self.candidates]
        return np.array([names.index(cause) for cause in self.causes])


def drawn(n_draws: int, seed: int) -> list[Conditions]:
    """The conditions that fit Tables 8 and 9, and n - 1 drawn about them."""
    streams = np.random.default_rng(seed).spawn(n_draws - 1)
    return [fitted_conditions(), *(drawn_conditions(rng) for rng in streams)]


def simulated(candidates: Sequence[Candidate], conditions: Sequence[Conditions], what: str) -> Library:
    """Simulate every candidate under all conditions, and fit the model to each."""
    found = [
        predicted(one, [candidate.valve(one) for candidate in candidates])
        for one in progress(conditions, what=what)
    ]
    return Library(
        candidates=list(candidates),
        conditions=list(conditions),
        after=np.minimum([one.after for one in found], MOST_ERROR),
        before=np.minimum([one.before for one in found], MOST_ERROR),
    )


def refined(library: Library) -> Library:
    """With a size between each two of one parameter; its errors are their geometric means."""
    candidates: list[Candidate] = []
    columns: list[tuple[int, int]] = []
    for i, candidate in enumerate(library.candidates):
        between = library.candidates[i - 1].halfway(candidate) if i else None
        if between is not None:
            candidates.append(between)
            columns.append((i - 1, i))
        candidates.append(candidate)
        columns.append((i, i))
    near, far = np.array(columns).T
    return Library(
        candidates=candidates,
        conditions=library.conditions,
        after=np.sqrt(library.after[:, near] * library.after[:, far]),
        before=np.sqrt(library.before[:, near] * library.before[:, far]),
    )


def only(library: Library, keep: NDArray) -> Library:
    """Some of the candidates, by index; every cause that is left keeps its place."""
    return Library(
        candidates=[library.candidates[i] for i in keep],
        conditions=library.conditions,
        after=library.after[:, keep],
        before=library.before[:, keep],
    )
