"""Separability: which causes a campaign could tell apart, from sensitivities alone."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.variable_projection import LinearisedRun, normal_equations
from identification.gap.rank.screening import CauseSignature
from identification.gap.rank.settings import RankingSettings


@dataclass(frozen=True, kw_only=True)
class Separability:
    """Signatures of n causes, less what calibrated and nuisance parameters absorb of them."""

    labels: tuple[str, ...]
    """Labels of the causes, (n,)."""
    signature_norms: NDArray
    """Length of each signature at the cause's first trial value, (n,) [noise deviations]."""
    correlation: NDArray
    """Correlations of the signatures, (n, n) [1]: near 1 or -1 for causes that look alike."""
    settings: RankingSettings
    """Thresholds of detection and of likeness."""

    @property
    def absorbed(self) -> tuple[str, ...]:
        """Causes that recalibration hides."""
        least = self.settings.detectable_signature
        pairs = zip(self.labels, self.signature_norms, strict=True)
        return tuple(label for label, norm in pairs if norm < least)

    def twins(self, label: str) -> tuple[str, ...]:
        """Causes that the campaign hardly tells from one cause, the most alike first."""
        return self.alike(label, self.settings.twin_correlation)

    def alike(self, label: str, least_correlation: float) -> tuple[str, ...]:
        """Detectable causes with a higher absolute correlation with one cause, the most alike first."""
        if label not in self.labels:
            return ()
        row = np.abs(self.correlation[self.labels.index(label)])
        order = np.argsort(-row, kind="stable")
        return tuple(
            self.labels[i]
            for i in order
            if row[i] > least_correlation
            and self.labels[i] != label
            and self.signature_norms[i] >= self.settings.detectable_signature
        )


def assess_separability(
    base_runs: Sequence[LinearisedRun],
    signatures: Sequence[CauseSignature],
    largest_deviation: float,
    settings: RankingSettings,
) -> Separability:
    """Separability of the causes at their first trial values.

    Args:
        base_runs: the base estimate linearised in the fitted runs.
        signatures: from `simulate_signatures` beside the same base.
        largest_deviation: bound of nuisance parameters [standard deviations].
        settings: thresholds that the result keeps.
    """
    first: dict[str, CauseSignature] = {}
    for signature in signatures:
        first.setdefault(signature.cause.label, signature)
    runs = [
        replace(run, slopes=np.column_stack([run.slopes, *(s.changes[r] for s in first.values())]))
        for r, run in enumerate(base_runs)
    ]
    hessian = normal_equations(runs, largest_deviation).hessian
    k = base_runs[0].slopes.shape[1]
    cross = hessian[:k, k:]
    gram = hessian[k:, k:] - cross.T @ np.linalg.solve(hessian[:k, :k] + 1e-9 * np.eye(k), cross)
    norms = np.sqrt(np.maximum(np.diag(gram), 0.0))
    divisors = np.maximum(norms, np.sqrt(np.finfo(float).tiny))
    return Separability(
        labels=tuple(first),
        signature_norms=norms,
        correlation=gram / np.outer(divisors, divisors),
        settings=settings,
    )
