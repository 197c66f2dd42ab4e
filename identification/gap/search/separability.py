"""Which causes the recordings cannot show, and which look alike, at their usual sizes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitting_problem import Estimate, FittingProblem
from identification.gap.fit.variable_projection import RIDGE, LinearisedRun, normal_equations
from identification.gap.search.screening import CauseSignature, changes_of, with_changes, without_base

DETECTABLE_SIGNATURE = 3.0
"""Length of a signature [noise deviations] below which the recordings do not show a cause at its usual
size; an announcement only, except that such a cause resembles no other."""


@dataclass(frozen=True, kw_only=True)
class Separability:
    """Signatures of n causes, less what calibrated and nuisance parameters absorb of them."""

    labels: tuple[str, ...]
    """Labels of the causes, (n,)."""
    signature_norms: NDArray
    """Length of each signature at the cause's first trial value, (n,) [noise deviations]."""
    correlation: NDArray
    """Correlations of the signatures, (n, n) [1]: near 1 or -1 for causes that look alike."""

    @property
    def absorbed(self) -> tuple[str, ...]:
        """Causes that recalibration hides."""
        pairs = zip(self.labels, self.signature_norms, strict=True)
        return tuple(label for label, norm in pairs if norm < DETECTABLE_SIGNATURE)

    def twins(self, label: str) -> tuple[str, ...]:
        """Detectable causes that the campaign hardly tells from one cause, the most alike first.

        Their signatures correlate above 0.98; an announcement only, no verdict uses it.
        """
        if label not in self.labels:
            return ()
        row = np.abs(self.correlation[self.labels.index(label)])
        order = np.argsort(-row, kind="stable")
        return tuple(
            self.labels[i]
            for i in order
            if row[i] > 0.98
            and self.labels[i] != label
            and self.signature_norms[i] >= DETECTABLE_SIGNATURE
        )


def assess_separability(
    base_runs: Sequence[LinearisedRun], signatures: Sequence[CauseSignature]
) -> Separability:
    """Separability of the causes at their first trial values.

    base_runs: the base estimate linearised in the fitted runs. signatures: beside the same base.
    """
    first = _first_of_each(signatures)
    gram, _ = without_base(base_runs, first)
    norms = np.sqrt(np.maximum(np.diag(gram), 0.0))
    divisors = np.maximum(norms, np.sqrt(np.finfo(float).tiny))
    return Separability(
        labels=tuple(signature.cause.label for signature in first),
        signature_norms=norms,
        correlation=gram / np.outer(divisors, divisors),
    )


def _first_of_each(signatures: Sequence[CauseSignature]) -> list[CauseSignature]:
    """The first signature of each cause."""
    first: dict[str, CauseSignature] = {}
    for signature in signatures:
        first.setdefault(signature.cause.label, signature)
    return list(first.values())


def adapted_signatures(
    problem: FittingProblem,
    base: Estimate,
    base_runs: Sequence[LinearisedRun],
    signatures: Sequence[CauseSignature],
) -> list[CauseSignature]:
    """The first signature of each cause after the calibrated parameters have adapted to it.

    A tangent does not show all that they absorb of a large change. They take linear steps while the
    next one at least halves what they leave.
    """
    found = _first_of_each(signatures)
    left = assess_separability(base_runs, found).signature_norms
    active = [i for i in range(len(found)) if left[i] >= DETECTABLE_SIGNATURE]
    while active:
        moved = _adapted(problem, base, base_runs, [found[i] for i in active])
        now = assess_separability(base_runs, moved).signature_norms
        halved = [k for k, i in enumerate(active) if now[k] < 0.5 * left[i]]
        for k in halved:
            found[active[k]], left[active[k]] = moved[k], now[k]
        active = [active[k] for k in halved if now[k] >= DETECTABLE_SIGNATURE]
    return found


def _adapted(
    problem: FittingProblem,
    base: Estimate,
    base_runs: Sequence[LinearisedRun],
    signatures: Sequence[CauseSignature],
) -> list[CauseSignature]:
    """The signatures after one linear step of the calibrated parameters against each."""
    k = len(base.vector)
    runs = [
        with_changes(run, [signature.changes[r] for signature in signatures])
        for r, run in enumerate(base_runs)
    ]
    hessian = normal_equations(runs).hessian
    steps = -np.linalg.solve(hessian[:k, :k] + RIDGE * np.eye(k), hessian[:k, k:])
    low, high = (end[:k] + base.vector for end in problem.ends(base))
    moved = []
    for signature, step in zip(signatures, steps.T, strict=True):
        vector = signature.estimate.vector.copy()
        vector[:k] = np.clip(vector[:k] + step, low, high)
        moved.append(replace(signature.estimate, vector=vector))
    changes = changes_of(problem, base, moved)
    return [
        CauseSignature(cause=signature.cause, estimate=estimate, changes=own)
        for signature, estimate, own in zip(signatures, moved, changes, strict=True)
    ]
