"""Which cause: screening, joint refits of singles and pairs, probabilities."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from identification.gap.evidence import Assessed, assess, inflation
from identification.gap.fit import Fitter, Hypothesis, Point, frames
from identification.gap.fits import Fits
from identification.gap.model import GreyBox
from identification.gap.screen import Screened, screen, signatures
from identification.gap.separability import Separability, separability

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

PARTNERS = 8
"""Causes that are tried beside each of the best two, where one cause leaves too much."""

WORTH = 200.0
"""Sum of squares that the best cause must leave, beyond noise or predictably, for a second cause to be
sought: less is soon in a form's error, or in chance."""

CLOSED = 0.6
"""Share of what its better half leaves that a pair may leave at most. Where forms err, any further
number lowers the misfit a little; a cause that acts lowers it a good deal."""

SMALL = 0.005
"""Share of the recalibrated model's squared misfit up to which what a cause leaves is soon its form's
error: some 7 % in amplitude. There a pair must be CLEAR."""

CLEAR = 500.0
"""Log evidence by which such a pair must beat its better half."""

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
    found = signatures(fitter, base, plant.causes)
    separable = separability(fitter, base, found)
    promising = screen(fitter, base, found)
    first = fits("single causes", lambda: _refit(fitter, base, promising[:SINGLES]))
    singles = _ranked(assess(fitter, first))
    like = _alike(singles[: FINALISTS[1]], promising[SINGLES:], separable)
    if like:
        more = fits("causes like the best", lambda: _refit(fitter, base, like))
        singles = _ranked([*singles, *assess(fitter, more)])
    none = _finals(fitter, assess(fitter, [base]), (1, 1), "recalibration", fits)[0]
    begun = {single.name: single.point for single in singles}
    margin = max(NEAR, 0.5 * (singles[0].log_evidence - none.log_evidence)) if singles else NEAR
    singles = _finals(fitter, singles, FINALISTS, "causes", fits, margin)
    floor = min(0.0, *(found.excess for found in (none, *singles)))
    pairs = _without_twins(_pairs(fitter, singles, begun, floor, fits))
    pairs = _finals(fitter, _ranked(pairs), [n // 2 for n in FINALISTS], "pairs", fits, margin)
    singles = _finals(fitter, _halves(fitter, singles, pairs, fits), (1,), "halves", fits)
    pairs = [pair for pair in pairs if _counts(pair, singles, none, floor)]
    return _weighed(fitter, none, singles, pairs, separable)


def recalibrated(plant: GreyBox, fits: Fits | None = None) -> tuple[Fitter, Point]:
    """The nominal model with its calibrated parameters refitted, and a fitter that knows nuisances."""
    fits = fits or Fits(plant)
    rough = Fitter(plant)
    start = rough.start(Hypothesis(causes=()), {})
    point = fits("calibration", lambda: rough.fit([start]))[0]
    fitter = Fitter(plant, frames(rough, [point], [np.zeros(len(plant.tolerances))])[0])
    return fitter, fits("recalibration", lambda: fitter.fit([_again(point)]))[0]


def _again(point: Point) -> Point:
    """The point as the beginning of another fit."""
    return replace(point, chi_square=np.inf, damping=1e-3, converged=False, given_up=False)


def _ranked(found: Sequence[Assessed]) -> list[Assessed]:
    return sorted(found, key=lambda assessed: -assessed.log_evidence)


def _alike(
    best: Sequence[Assessed], others: Sequence[Screened], separable: Separability
) -> list[Screened]:
    """Causes that were screened out, though what they change looks like what one of the best does."""
    labels = [label for found in best for label in separable.like(found.name[0], ALIKE)]
    return [screened for screened in others if screened.cause.label in labels]


def _finals(
    fitter: Fitter,
    found: list[Assessed],
    counts: Sequence[int],
    what: str,
    fits: Fits,
    margin: float = np.inf,
) -> list[Assessed]:
    """The best of them fitted on, with nuisances linearised where each of them stands.

    found: the most probable first, as what is returned. counts: how many of them at most, round by
    round. margin: log evidence by which the best one may lead them.
    """
    for number, most in enumerate(counts if found else (), start=1):
        near = [
            assessed
            for assessed in found[:most]
            if found[0].log_evidence - assessed.log_evidence <= margin
        ]
        count, points = len(near), [assessed.point for assessed in near]
        own = frames(fitter, points, [assessed.tolerances for assessed in near])
        starts = [replace(_again(p), frame=frame) for p, frame in zip(points, own, strict=True)]
        fitted = fits(f"{what}: own nuisances, round {number}", partial(fitter.fit, starts))
        framed = [replace(p, frame=frame) for p, frame in zip(fitted, own, strict=True)]
        found = _ranked([*assess(fitter, framed), *found[count:]])
    return found


def _pairs(
    fitter: Fitter,
    singles: list[Assessed],
    begun: Mapping[tuple[str, ...], Point],
    floor: float,
    fits: Fits,
) -> list[Assessed]:
    """Pairs that may explain what the best causes leave, where that is WORTH it.

    begun: where each cause was before its nuisances followed what it lacks; from there a partner is seen
    best. floor: as of `_left`.
    """
    if not singles or _left(singles[0], floor) <= WORTH:
        return []
    most = RIVAL * _left(singles[0], floor)
    bases = [single for single in singles[:2] if _left(single, floor) <= most]
    return [pair for base in bases for pair in assess(fitter, _partners(fitter, begun[base.name], fits))]


def _counts(pair: Assessed, singles: Sequence[Assessed], none: Assessed, floor: float) -> bool:
    """Whether a pair is more than its better half alone, whose form errs."""
    halves = [single for single in singles if single.name[0] in pair.name]
    if pair.at_end or not halves:
        return not pair.at_end
    left = min(_left(half, floor) for half in halves)
    small = left <= SMALL * (none.excess - floor)
    gain = pair.log_evidence - max(half.log_evidence for half in halves)
    return _left(pair, floor) <= CLOSED * left and (gain > CLEAR or not small)


def _left(found: Assessed, floor: float) -> float:
    """Sum of squares that a hypothesis leaves: beyond the floor, or what is predictable of it.

    floor: where the noise is known too large, what the best hypothesis leaves.
    """
    return max(found.excess - floor, 2.0 * (found.with_leftover - found.log_evidence))


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
        starts.append(replace(point, frame=base.frame))
    return [point for point in fitter.fit(starts, base.chi_square) if not point.given_up]


def _halves(
    fitter: Fitter, singles: list[Assessed], pairs: Sequence[Assessed], fits: Fits
) -> list[Assessed]:
    """Singles, of which those in the best pair have also been fitted from where they stand there.

    Far from its size a cause may get stuck, and a pair find the way round.
    """
    if not pairs:
        return singles
    pair, base = pairs[0].point, fitter.values(pairs[0].point)
    starts = [
        replace(fitter.start(Hypothesis(causes=(cause,)), base), frame=pair.frame)
        for cause in pair.hypothesis.causes
    ]
    alone = assess(fitter, fits("halves of the best pair", lambda: fitter.fit(starts)))
    return _ranked(_without_twins([*singles, *alone]))


def _without_twins(found: Sequence[Assessed]) -> list[Assessed]:
    """The best of several fits of the same causes, begun from different places."""
    best: dict[frozenset[str], Assessed] = {}
    for one in sorted(found, key=lambda assessed: assessed.log_evidence):
        best[frozenset(one.name)] = one
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
