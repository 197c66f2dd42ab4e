"""Screening of pairs: causes that explain much together, though neither does alone."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from identification.gap.fit.variable_projection import LinearisedRun, normal_equations
from identification.gap.rank.screening import CauseSignature


def promising_pairs(
    base_runs: Sequence[LinearisedRun],
    signatures: Sequence[CauseSignature],
    largest_deviation: float,
) -> list[frozenset[str]]:
    """Pairs of labels by falling decrease of chi-square, both changes taken as linear in their sizes.

    A negative size is none where the range begins at off.

    Args:
        base_runs: the base estimate linearised in the fitted runs.
        signatures: from `simulate_signatures` beside the same base; the first of each cause counts.
        largest_deviation: bound of nuisance parameters [standard deviations].
    """
    first: dict[str, CauseSignature] = {}
    for signature in signatures:
        first.setdefault(signature.cause.label, signature)
    labels, causes = list(first), [signature.cause for signature in first.values()]
    least = np.array([signature.shares[0] for signature in first.values()])
    runs = [
        replace(run, slopes=np.column_stack([run.slopes, *(s.changes[r] for s in first.values())]))
        for r, run in enumerate(base_runs)
    ]
    equations = normal_equations(runs, largest_deviation)
    k = base_runs[0].slopes.shape[1]
    hessian, gradient = equations.hessian, equations.gradient
    own = hessian[:k, :k] + 1e-9 * np.eye(k)
    solved = np.linalg.solve(own, np.column_stack([gradient[:k], hessian[:k, k:]]))
    moment = gradient[k:] - hessian[k:, :k] @ solved[:, 0]
    gram = hessian[k:, k:] - hessian[k:, :k] @ solved[:, 1:]
    gains: dict[frozenset[str], float] = {}
    for i, j in combinations(range(len(labels)), 2):
        pair = [i, j]
        matrix = gram[np.ix_(pair, pair)] + 1e-9 * np.eye(2)
        sizes = np.linalg.solve(matrix, moment[pair])
        possible = np.all((sizes > 0) | (least[pair] < 0))
        if causes[i].name != causes[j].name and possible:
            gains[frozenset((labels[i], labels[j]))] = float(sizes @ moment[pair])
    return sorted(gains, key=lambda pair: -gains[pair])
