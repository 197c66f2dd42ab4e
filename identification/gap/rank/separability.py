"""Which causes a campaign could tell apart, from the sensitivities alone: no residual is looked at."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitter import Fitter, Point
from identification.gap.fit.variable_projection import normal
from identification.gap.rank.screening import Signature

TWINS = 0.98
"""Correlation of two causes' signatures above which recordings hardly tell them apart."""

FELT = 3.0
"""Signature in noise deviations below which a cause at its usual size is not felt."""


@dataclass(frozen=True, kw_only=True)
class Separability:
    """Signatures of causes after recalibration, starts and the scatter of units have had their share."""

    labels: tuple[str, ...]
    felt: NDArray
    """Length of each signature at the cause's usual size, in noise deviations, (n,)."""
    correlation: NDArray
    """Of the signatures, (n, n): near 1 or -1 for causes that look alike."""

    @property
    def absorbed(self) -> tuple[str, ...]:
        """Causes that recalibration hides."""
        return tuple(label for label, felt in zip(self.labels, self.felt, strict=True) if felt < FELT)

    def twins(self, label: str) -> tuple[str, ...]:
        """Causes that the campaign hardly tells from one, the most alike first."""
        return self.like(label, TWINS)

    def like(self, label: str, least: float) -> tuple[str, ...]:
        """Causes that are felt, and correlate with one by more than `least`; the most alike first."""
        if label not in self.labels:
            return ()
        row = np.abs(self.correlation[self.labels.index(label)])
        order = np.argsort(-row, kind="stable")
        return tuple(
            self.labels[i]
            for i in order
            if row[i] > least and self.labels[i] != label and self.felt[i] >= FELT
        )


def separability(fitter: Fitter, base: Point, signatures: Sequence[Signature]) -> Separability:
    """Of each cause's first trial size, at the base point, on the fitted runs."""
    first: dict[str, Signature] = {}
    for signature in signatures:
        first.setdefault(signature.cause.label, signature)
    own = fitter.linearise([base], fitter.fitted)[0]
    both = [
        replace(run, slopes=np.column_stack([run.slopes, *(s.changes[r] for s in first.values())]))
        for r, run in enumerate(own)
    ]
    hessian = normal(both).hessian
    k = len(base.vector)
    cross = hessian[:k, k:]
    gram = hessian[k:, k:] - cross.T @ np.linalg.solve(hessian[:k, :k] + 1e-9 * np.eye(k), cross)
    felt = np.sqrt(np.maximum(np.diag(gram), 0.0))
    size = np.maximum(felt, np.sqrt(np.finfo(float).tiny))
    return Separability(labels=tuple(first), felt=felt, correlation=gram / np.outer(size, size))
