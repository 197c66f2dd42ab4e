"""Which cause: screening, joint refits of singles and pairs, probabilities."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.gap.evidence import Assessed, assess, inflation
from identification.gap.fit import Fitter, Hypothesis, Point, shared_frame
from identification.gap.fits import Fits
from identification.gap.model import GreyBox
from identification.gap.screen import Screened, screen, signatures
from identification.gap.separability import Separability, separability

SINGLES = 10
"""Causes that are refitted, the most promising ones."""

PARTNERS = 4
"""Causes that are tried beside each of the best two, where one cause leaves too much."""

SMALL = 0.005
"""Share of the recalibrated model's squared misfit up to which what a cause leaves is its form's error:
some 7 % in amplitude. No second cause is sought for it."""

CLOSED = 0.3
"""Share of what a cause leaves that a pair may leave at most, to be more than that cause alone."""

RIVAL = 3.0
"""Times what the best cause leaves, up to which a pair is also sought beside the second best."""

LEFTOVER = 0.02
"""Share of the recalibrated model's squared misfit that a cause may leave and still be called the cause:
an error of its form of some 14 % in amplitude."""

PRIOR = {"none": 0.4, "single": 0.4, "pair": 0.1, "unknown": 0.1}
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
    separability: Separability
    """What could be told apart, whatever the residual."""


def which(plant: GreyBox, fits: Fits | None = None) -> Verdicts:
    """Refit what is worth it and weigh it; a fit that does not converge is weighed as it is.

    fits: runs the steps, and may remember them from an interrupted run.
    """
    fits = fits or Fits(plant)
    fitter, base = recalibrated(plant, fits)
    none = assess(fitter, [base])[0]
    found = signatures(fitter, base, plant.causes)
    promising = screen(fitter, base, found)[:SINGLES]
    singles = assess(fitter, fits("single causes", lambda: _refit(fitter, base, promising)))
    singles.sort(key=lambda found: -found.log_evidence)
    pairs = _without_twins(_pairs(fitter, none, singles, fits))
    return _weighed(fitter, none, singles, pairs, separability(fitter, base, found))


def recalibrated(plant: GreyBox, fits: Fits | None = None) -> tuple[Fitter, Point]:
    """The nominal model with its calibrated parameters refitted, and a fitter that knows nuisances."""
    fits = fits or Fits(plant)
    rough = Fitter(plant)
    start = rough.start(Hypothesis(causes=()), {})
    point = fits("calibration", lambda: rough.fit([start]))[0]
    fitter = Fitter(plant, shared_frame(plant, point))
    again = replace(point, chi_square=np.inf, damping=1e-3, converged=False)
    return fitter, fits("recalibration", lambda: fitter.fit([again]))[0]


def _pairs(fitter: Fitter, none: Assessed, singles: list[Assessed], fits: Fits) -> list[Assessed]:
    """Pairs that explain what the best causes leave, where that is predictable and more than SMALL.

    A pair must close a good part of what its better half leaves: where forms err, any further number
    lowers the misfit a little.
    """
    if not singles or singles[0].with_leftover <= singles[0].log_evidence:
        return []
    floor = min(0.0, *(found.excess for found in (none, *singles)))
    if singles[0].excess - floor <= SMALL * (none.excess - floor):
        return []
    found = []
    for single in singles[:2]:
        left = single.excess - floor
        if single is singles[0] or left <= RIVAL * (singles[0].excess - floor):
            both = assess(fitter, _partners(fitter, single.point, fits))
            found += [pair for pair in both if pair.excess - floor <= CLOSED * left]
    return found


def _partners(fitter: Fitter, base: Point, fits: Fits) -> list[Point]:
    """Fits of pairs: what may act beside the causes of the base."""
    own = base.hypothesis.causes[0].name
    others = [cause for cause in fitter.plant.causes if cause.name != own]

    def refit() -> list[Point]:
        promising = screen(fitter, base, signatures(fitter, base, others))[:PARTNERS]
        return _refit(fitter, base, promising)

    return fits(f"pairs with {' and '.join(base.hypothesis.name)}", refit)


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
    return [point for point in fitter.fit(starts, base.chi_square) if not point.given_up]


def _without_twins(pairs: Sequence[Assessed]) -> list[Assessed]:
    """The better of two fits of the same causes, begun from either of them."""
    best: dict[frozenset[str], Assessed] = {}
    for pair in sorted(pairs, key=lambda found: found.log_evidence):
        best[frozenset(pair.name)] = pair
    return list(best.values())


def _weighed(
    fitter: Fitter,
    none: Assessed,
    singles: list[Assessed],
    pairs: list[Assessed],
    separable: Separability,
) -> Verdicts:
    """Probabilities of all hypotheses."""
    causes = sum(cause.prior for cause in fitter.plant.causes)
    candidates = [*singles, *pairs]
    best = max([none, *candidates], key=lambda found: found.log_evidence)
    temper = 1.0 / inflation(fitter, best.residuals)
    small = [found.excess <= LEFTOVER * none.excess and not found.at_end for found in candidates]
    scores = [
        temper * (max(found.log_evidence, found.with_leftover) if s else found.log_evidence)
        + (-np.inf if found.at_end else _log_prior(found, causes))
        for found, s in zip(candidates, small, strict=True)
    ]
    no_cause = temper * none.log_evidence + np.log(PRIOR["none"])
    large = [none, *(found for found, s in zip(candidates, small, strict=True) if not s)]
    unknown = temper * max(found.with_leftover for found in large) + np.log(PRIOR["unknown"])
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
        separability=separable,
    )


def _log_prior(found: Assessed, total: float) -> float:
    """Log probability of a cause or pair before any data."""
    shares = [cause.prior / total for cause in found.point.hypothesis.causes]
    if len(shares) == 1:
        return float(np.log(PRIOR["single"] * shares[0]))
    return float(np.log(PRIOR["pair"] * 2 * np.prod(shares)))
