"""Which cause: screening, joint refits of singles and pairs, probabilities."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.gap.evidence import Assessed, assess, generic_log_evidence, inflation
from identification.gap.fit import Fitter, Hypothesis, Point, shared_frame
from identification.gap.model import GreyBox
from identification.gap.screen import Screened, screen

SINGLES = 12
"""Causes that are refitted, the most promising ones."""

PARTNERS = 4
"""Causes that are tried beside each of the best two, where one cause leaves too much."""

PRIOR = {"none": 0.25, "single": 0.5, "pair": 0.15, "unknown": 0.1}
"""Probabilities before any data."""


@dataclass(frozen=True, kw_only=True)
class Verdicts:
    """Every hypothesis that was refitted, and the probability of each."""

    fitter: Fitter
    none: Assessed
    candidates: list[Assessed]
    """Causes and pairs, the most probable first."""
    probability: list[float]
    """Of `candidates`."""
    no_cause: float
    unknown: float


def which(plant: GreyBox) -> Verdicts:
    """Refit what is worth it and weigh it. Raises nothing: a fit that fails is weighed as it is."""
    fitter, base = recalibrated(plant)
    none = assess(fitter, [base])[0]
    singles = assess(fitter, _refit(fitter, base, screen(fitter, base, plant.causes)[:SINGLES]))
    singles.sort(key=lambda found: -found.log_evidence)
    pairs: list[Assessed] = []
    generic = generic_log_evidence(fitter, singles[0].residuals)
    if generic > singles[0].log_evidence:
        for best in singles[:2]:
            others = [c for c in plant.causes if c.name != best.point.hypothesis.causes[0].name]
            promising = screen(fitter, best.point, others)[:PARTNERS]
            pairs += assess(fitter, _refit(fitter, best.point, promising))
        pairs = _without_twins(pairs)
    return _weighed(fitter, none, singles, pairs)


def recalibrated(plant: GreyBox) -> tuple[Fitter, Point]:
    """The nominal model with its calibrated parameters refitted, and a fitter that knows nuisances."""
    rough = Fitter(plant)
    point = rough.fit([rough.start(Hypothesis(causes=()), {})])[0]
    fitter = Fitter(plant, shared_frame(plant, point))
    again = replace(point, chi_square=np.inf, damping=1e-3, converged=False)
    return fitter, fitter.fit([again])[0]


def _refit(fitter: Fitter, base: Point, promising: Sequence[Screened]) -> list[Point]:
    """Each promising cause added to the base and refitted."""
    starts = []
    for found in promising:
        joint = Hypothesis(causes=(*base.hypothesis.causes, found.cause))
        sizes = {s.symbol: v for s, v in zip(found.cause.sizes, found.sizes, strict=True)}
        point = fitter.start(joint, {**fitter.values(base), **sizes})
        own = len(base.hypothesis.local)
        point.local[:, :own] = base.local
        starts.append(point)
    return fitter.fit(starts)


def _without_twins(pairs: Sequence[Assessed]) -> list[Assessed]:
    """The better of two fits of the same causes, begun from either of them."""
    best: dict[frozenset[str], Assessed] = {}
    for pair in sorted(pairs, key=lambda found: found.log_evidence):
        best[frozenset(pair.name)] = pair
    return list(best.values())


def _weighed(fitter: Fitter, none: Assessed, singles: list[Assessed], pairs: list[Assessed]) -> Verdicts:
    causes = sum(cause.prior for cause in fitter.plant.causes)
    candidates = [*singles, *pairs]
    best = max([none, *candidates], key=lambda found: found.log_evidence)
    temper = 1.0 / inflation(fitter, best.residuals)
    scores = [temper * found.log_evidence + _log_prior(found, causes) for found in candidates]
    no_cause = temper * none.log_evidence + np.log(PRIOR["none"])
    unknown = temper * generic_log_evidence(fitter, none.residuals) + np.log(PRIOR["unknown"])
    scores = np.array([*scores, no_cause, unknown])
    weights = np.exp(scores - np.max(scores))
    weights /= np.sum(weights)
    order = np.argsort(-weights[: len(candidates)], kind="stable")
    return Verdicts(
        fitter=fitter,
        none=none,
        candidates=[candidates[i] for i in order],
        probability=weights[order].tolist(),
        no_cause=float(weights[-2]),
        unknown=float(weights[-1]),
    )


def _log_prior(found: Assessed, total: float) -> float:
    """Log probability of a cause or pair before any data."""
    shares = [cause.prior / total for cause in found.point.hypothesis.causes]
    if len(shares) == 1:
        return float(np.log(PRIOR["single"] * shares[0]))
    return float(np.log(PRIOR["pair"] * 2 * np.prod(shares)))
