"""Refitting hypotheses: from where they are, from a base, and with nuisances of their own."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from identification.gap.fit.fit_cache import Fits
from identification.gap.fit.fitter import Fitter, Hypothesis, Point, frames
from identification.gap.model.grey_box import GreyBox
from identification.gap.rank.evidence import Assessed, assess
from identification.gap.rank.screening import Screened


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


def refitted(fitter: Fitter, base: Point, promising: Sequence[Screened]) -> list[Point]:
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


def fitted_on(
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
        found = ranked([*assess(fitter, framed), *found[count:]])
    return found


def ranked(found: Sequence[Assessed]) -> list[Assessed]:
    """The most probable first, whatever they were before the data."""
    return sorted(found, key=lambda assessed: -assessed.log_evidence)


def without_twins(found: Sequence[Assessed]) -> list[Assessed]:
    """The best of several fits of the same causes, begun from different places."""
    best: dict[frozenset[str], Assessed] = {}
    for one in sorted(found, key=lambda assessed: assessed.log_evidence):
        best[frozenset(one.name)] = one
    return list(best.values())
