"""Two causes at once: which partners are tried, and how likely a second cause is beside an erring form.

Where the form of a cause errs, any second one helps, and evidence that counts every stretch apart is
soon sure of it, since such errors persist. So no pair is surer against its better half than experience
allows: the blind trials of seeds 2027 and 2028, opened for it (docs/gap.md).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.gap.fit.fit_cache import Fits
from identification.gap.fit.fitter import Fitter, Hypothesis, Point
from identification.gap.rank.evidence import Assessed, assess
from identification.gap.rank.refit import ranked, refitted, without_twins
from identification.gap.rank.screening import screen, signatures

PARTNERS, FEW = 8, 4
"""Causes that are tried beside each of the best two, where one cause leaves too much; beside the best,
where it does not."""

WORTH = 200.0
"""Sum of squares, beyond noise or predictable, up to which what a cause leaves is not too much."""

CERTAIN = 10.0
"""Log evidence of a cause against none from which a second one is sought at all."""

EVEN = 7.5e-3
"""Log evidence per reading that a pair gains on its better half, both beside a misfit without a name, at
which a second cause is as likely as an error of form; the odds go with its square."""

CHANCE, FAINT = 15.0, 0.12
"""Such a gain up to which a second cause is chance, and the least odds of one that gains more: beside a
strong cause a faint one gains little."""

NEVER = 1e-6
"""Odds of chance."""

CLOSED = 0.6
"""Share of what its better half leaves that a pair may leave at most to vouch for that half: what both
fail to explain may have no name."""

RIVAL = 3.0
"""Times what the best cause leaves, up to which a pair is also sought beside the second best."""


def pairs(
    fitter: Fitter,
    none: Assessed,
    singles: list[Assessed],
    begun: Mapping[tuple[str, ...], Point],
    floor: float,
    fits: Fits,
) -> list[Assessed]:
    """Pairs that may explain what the best causes leave; beside a cause that is CERTAIN alone.

    begun: where each cause was before its nuisances followed what it lacks; from there a partner is seen
    best. floor: as of `_left`.
    """
    if not singles or singles[0].log_evidence - none.log_evidence < CERTAIN:
        return []
    count, most = (PARTNERS, 2) if leaves_much(singles[0], floor) else (FEW, 1)
    enough = RIVAL * _left(singles[0], floor)
    bases = [single for single in singles[:most] if _left(single, floor) <= enough]
    return [
        pair
        for base in bases
        for pair in assess(fitter, _partners(fitter, begun[base.name], count, fits))
    ]


def doubted(found: Sequence[Assessed], scores: Sequence[float], floor: float) -> list[float]:
    """Log probabilities, but for a constant, in which no pair is surer of itself than its odds allow.

    A pair that closes what its better half leaves vouches for this half: it is raised to the pair's
    odds. Otherwise all pairs with this half are lowered to them. floor: as of `_left`.
    """
    changed = list(scores)
    mine: dict[int, list[int]] = {}
    for i, one in enumerate(found):
        half = _better_half(one, found) if len(one.name) > 1 else None
        if half is not None:
            mine.setdefault(half, []).append(i)
    for half, with_half in mine.items():
        best = max(with_half, key=lambda pair: scores[pair])
        surplus = scores[best] - _log_odds(found[best], found[half]) - scores[half]
        if surplus <= 0:
            continue
        closed = _left(found[best], floor) <= CLOSED * _left(found[half], floor)
        if closed and leaves_much(found[half], floor):
            changed[half] += surplus
        else:
            for pair in with_half:
                changed[pair] -= surplus
    return changed


def _better_half(pair: Assessed, found: Sequence[Assessed]) -> int | None:
    """Place of the half that does better alone; None if neither does within its range."""
    halves = [
        i
        for i, one in enumerate(found)
        if len(one.name) == 1 and one.name[0] in pair.name and not one.at_end
    ]
    return max(halves, key=lambda half: found[half].log_evidence, default=None)


def _log_odds(pair: Assessed, half: Assessed) -> float:
    """How much likelier a second cause is than an error of the first one's form."""
    gain = pair.with_leftover - half.with_leftover
    even = EVEN * sum(np.count_nonzero(residual) for residual in pair.residuals)
    return float(np.log((gain / even) ** 2 + FAINT if gain > CHANCE else NEVER))


def with_halves(
    fitter: Fitter, singles: list[Assessed], found: Sequence[Assessed], fits: Fits
) -> list[Assessed]:
    """Singles, of which those in the best pair have also been fitted from where they stand there.

    Far from its size a cause may get stuck, and a pair find the way round. found: pairs, at least
    one, the most probable first.
    """
    pair, base = found[0].point, fitter.values(found[0].point)
    starts = [
        replace(fitter.start(Hypothesis(causes=(cause,)), base), frame=pair.frame)
        for cause in pair.hypothesis.causes
    ]
    alone = fits("halves of the best pair", lambda: fitter.fit(starts))
    framed = [replace(point, frame=pair.frame) for point in alone]  # a journal keeps no frames
    return ranked(without_twins([*singles, *assess(fitter, framed)]))


def leaves_much(found: Assessed, floor: float) -> bool:
    """Whether a hypothesis leaves more than it is WORTH. floor: as of `_left`."""
    return _left(found, floor) > WORTH


def _partners(fitter: Fitter, base: Point, count: int, fits: Fits) -> list[Point]:
    """Fits of pairs: what may act beside the causes of the base."""
    own = base.hypothesis.causes[0].name
    others = [cause for cause in fitter.plant.causes if cause.name != own]

    def refit() -> list[Point]:
        promising = screen(fitter, base, signatures(fitter, base, others))[:count]
        return refitted(fitter, base, promising)

    return fits(f"pairs with {' and '.join(base.hypothesis.name)}", refit)


def _left(found: Assessed, floor: float) -> float:
    """Sum of squares that a hypothesis leaves: beyond the floor, or what is predictable of it.

    floor: where the noise is known too large, what the best hypothesis leaves.
    """
    return max(found.excess - floor, 2.0 * (found.with_leftover - found.log_evidence))
