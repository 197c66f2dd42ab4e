"""Two causes at once: which partners are tried, and when a pair is more than its better half."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from identification.gap.evidence import Assessed, assess
from identification.gap.fit import Fitter, Hypothesis, Point
from identification.gap.fits import Fits
from identification.gap.refit import ranked, refitted, without_twins
from identification.gap.screen import screen, signatures

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


def pairs(
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


def counts(pair: Assessed, singles: Sequence[Assessed], none: Assessed, floor: float) -> bool:
    """Whether a pair is more than its better half alone, whose form errs."""
    if pair.at_end:
        return False
    halves = [single for single in singles if single.name[0] in pair.name]
    if not halves:
        return True
    left = min(_left(half, floor) for half in halves)
    small = left <= SMALL * (none.excess - floor)
    gain = pair.log_evidence - max(half.log_evidence for half in halves)
    return _left(pair, floor) <= CLOSED * left and (gain > CLEAR or not small)


def with_halves(
    fitter: Fitter, singles: list[Assessed], found: Sequence[Assessed], fits: Fits
) -> list[Assessed]:
    """Singles, of which those in the best pair have also been fitted from where they stand there.

    Far from its size a cause may get stuck, and a pair find the way round. found: pairs, the most
    probable first.
    """
    if not found:
        return singles
    pair, base = found[0].point, fitter.values(found[0].point)
    starts = [
        replace(fitter.start(Hypothesis(causes=(cause,)), base), frame=pair.frame)
        for cause in pair.hypothesis.causes
    ]
    alone = assess(fitter, fits("halves of the best pair", lambda: fitter.fit(starts)))
    return ranked(without_twins([*singles, *alone]))


def _partners(fitter: Fitter, base: Point, fits: Fits) -> list[Point]:
    """Fits of pairs: what may act beside the causes of the base."""
    own = base.hypothesis.causes[0].name
    others = [cause for cause in fitter.plant.causes if cause.name != own]

    def refit() -> list[Point]:
        promising = screen(fitter, base, signatures(fitter, base, others))[:PARTNERS]
        return refitted(fitter, base, promising)

    return fits(f"pairs with {' and '.join(base.hypothesis.name)}", refit)


def _left(found: Assessed, floor: float) -> float:
    """Sum of squares that a hypothesis leaves: beyond the floor, or what is predictable of it.

    floor: where the noise is known too large, what the best hypothesis leaves.
    """
    return max(found.excess - floor, 2.0 * (found.with_leftover - found.log_evidence))
