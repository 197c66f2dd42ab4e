"""Which cause: screening, joint refits of singles and pairs, probabilities."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import softmax

from identification.gap.fit.fit_cache import Fits
from identification.gap.fit.fitter import Fitter
from identification.gap.model.grey_box import GreyBox
from identification.gap.rank.cause_pairs import doubted, leaves_much, pairs, with_halves
from identification.gap.rank.evidence import Assessed, assess, inflation
from identification.gap.rank.refit import fitted_on, ranked, recalibrated, refitted, without_twins
from identification.gap.rank.screening import Screened, screen, signatures
from identification.gap.rank.separability import Separability, separability

SINGLES = 20
"""Causes that are refitted, the most promising ones."""

FINALISTS = (14, 5)
"""Causes that are fitted on with nuisances linearised where each of them stands: so many, then fewer.
Half as many pairs."""

NEAR = 250.0
"""Log evidence by which the best fit may lead one that is fitted on, or half of what the best gains on
the recalibrated model, if that is more."""

ALIKE = 0.8
"""Correlation with a finalist's signature above which a cause that was screened out is refitted."""

LEFTOVER = 0.025
"""Share of the recalibrated model's squared misfit that a cause may leave and still be called the cause:
an error of its form of some 16 % in amplitude."""

PRIOR = {"none": 0.4, "single": 0.4, "pair": 0.1, "unknown": 0.1}
"""Probabilities before any data."""


@dataclass(frozen=True, kw_only=True)
class Verdicts:
    """Every hypothesis that was refitted, and the probability of each."""

    fitter: Fitter
    none: Assessed
    candidates: list[Assessed]
    """Causes and pairs, the most probable first."""
    scores: list[float]
    """Log probability of `candidates`, but for a constant."""
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
    found = signatures(fitter, base, plant.causes)
    separable = separability(fitter, base, found)
    promising = screen(fitter, base, found)
    first = fits("single causes", lambda: refitted(fitter, base, promising[:SINGLES]))
    singles = ranked(assess(fitter, first))
    like = _alike(singles[: FINALISTS[1]], promising[SINGLES:], separable)
    if like:
        more = fits("causes like the best", lambda: refitted(fitter, base, like))
        singles = ranked([*singles, *assess(fitter, more)])
    none = fitted_on(fitter, assess(fitter, [base]), (1, 1), "recalibration", fits)[0]
    begun = {single.name: single.point for single in singles}
    margin = max(NEAR, 0.5 * (singles[0].log_evidence - none.log_evidence)) if singles else NEAR
    singles = fitted_on(fitter, singles, FINALISTS, "causes", fits, margin)
    floor = min(0.0, *(found.excess for found in (none, *singles)))
    both = without_twins(pairs(fitter, none, singles, begun, floor, fits))
    both = fitted_on(fitter, ranked(both), [n // 2 for n in FINALISTS], "pairs", fits, margin)
    if both and leaves_much(singles[0], floor):
        singles = fitted_on(fitter, with_halves(fitter, singles, both, fits), (1,), "halves", fits)
    both = [pair for pair in both if not pair.at_end]
    return _weighed(fitter, none, [*singles, *both], floor, separable)


def _alike(
    best: Sequence[Assessed], others: Sequence[Screened], separable: Separability
) -> list[Screened]:
    """Causes that were screened out, though what they change looks like what one of the best does."""
    labels = [label for found in best for label in separable.like(found.name[0], ALIKE)]
    return [screened for screened in others if screened.cause.label in labels]


def _weighed(
    fitter: Fitter,
    none: Assessed,
    candidates: list[Assessed],
    floor: float,
    separable: Separability,
) -> Verdicts:
    """Probabilities of all hypotheses."""
    causes = sum(cause.prior for cause in fitter.plant.causes)
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
    scores = doubted(candidates, scores, floor)
    weights = softmax([*scores, no_cause, unknown])
    order = np.argsort(-np.array(scores), kind="stable")
    return Verdicts(
        fitter=fitter,
        none=none,
        candidates=[candidates[i] for i in order],
        scores=[scores[i] for i in order],
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
