"""In which part of the recordings a single cause acts, by linear prediction.

A cause changes the runs outside its span not at all, and those within it in proportion to its signature.
So one simulation of each cause serves every span.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax

from identification.block_bootstrap import LEVEL
from identification.gap.fit.variable_projection import LinearisedRun, eliminated, normal_equations
from identification.gap.search.posterior import log_likelihoods, tolerated_misfit
from identification.gap.search.screening import CauseSignature, with_changes

KINDS = {"whole": 0.5, "late": 0.4, "mended": 0.1}
"""Probability before the data that a cause acts in all drives, from a later one on, or ends [1]."""


@dataclass(frozen=True)
class Onset:
    """Drives of an operation log in which a cause acts, where these are not all."""

    drive: str
    """File of the first one."""
    probability: float
    """That the cause begins and ends there, if it acts at all."""
    mended: str | None
    """File of the first drive after them; None where it acts to the end."""
    earliest: str
    """The first drive lies between this file and `latest` with the probability LEVEL: a drive with few
    openings, or none, hardly shows whether the cause acts in it."""
    latest: str


@dataclass(frozen=True)
class Span:
    """Drives in which a cause acts."""

    first: int
    """Number of the first drive, from 0."""
    end: int
    """Number of the first drive after it."""
    probability: float
    """That it begins and ends there, if the cause acts at all."""
    whole: bool
    """Whether these are all drives of the log."""
    first_between: tuple[int, int]
    """Least and largest number of the first drive with the probability LEVEL."""

    def onset(self, drives: Sequence[str]) -> Onset | None:
        """In words; None where the cause acts in all drives."""
        if self.whole:
            return None
        mended = drives[self.end] if self.end < len(drives) else None
        earliest, latest = (drives[number] for number in self.first_between)
        return Onset(drives[self.first], self.probability, mended, earliest, latest)


@dataclass(frozen=True)
class LinearisedLog:
    """What each cause would change in the recordings of a log, by linear prediction."""

    runs: Sequence[LinearisedRun]
    """The model without a cause, linearised."""
    signatures: Sequence[CauseSignature]
    """Of the causes beside it."""
    drives: NDArray
    """Number of each run's drive, (runs,)."""
    count: int
    """Of drives."""
    readings: int
    """How many the runs have."""
    lasting: Collection[str] = ()
    """Labels of causes that act in all drives."""


def spans_of_causes(log: LinearisedLog) -> dict[str, Span]:
    """The most probable drives of each cause by its label, by linear prediction.

    Each cause alone; where the best one leaves more than the tolerated misfit, those that are worse by
    more than that beside it: alone they do not count.
    """
    signatures, readings = log.signatures, log.readings
    spans = [s for s in combinations(range(log.count + 1), 2) if np.any(in_span(log.drives, *s))]
    acting = np.array([in_span(log.drives, *span) for span in spans])
    lasting = [s.cause.label in log.lasting for s in signatures]
    excluded = np.outer(lasting, [s != (0, log.count) for s in spans])
    squares = np.where(excluded, np.inf, least_squares_by_span(log.runs, signatures, acting))
    first, at = (int(place) for place in np.unravel_index(np.argmin(squares), squares.shape))
    found = _likeliest(signatures, squares, spans, log.count, readings)
    tolerated = 2.0 * tolerated_misfit(readings)
    if np.min(squares) > readings + tolerated:
        beside = least_squares_by_span(log.runs, signatures, acting, (signatures[first], acting[at]))
        beside = np.where(excluded, np.inf, beside)
        second = _likeliest(signatures, beside, spans, log.count, readings)
        least = np.min(squares, axis=1)
        near = {
            s.cause.label
            for s, own in zip(signatures, least, strict=True)
            if own <= np.min(least) + tolerated
        }
        found = second | {label: found[label] for label in near}
    return found


def gain_by_change(log: LinearisedLog, known: bool = False) -> float:
    """By how much causes that act in some drives better what acts in all [tolerated misfits].

    By linear prediction: one of them beside the best that acts in all. 1 may be chance. known: what acts
    in all drives counts as a change, too.
    """
    signatures = log.signatures
    spans = [span for span in combinations(range(log.count + 1), 2) if span != (0, log.count)]
    acting = np.array([in_span(log.drives, *span) for span in spans])
    everywhere = np.ones(len(log.drives), dtype=bool)
    none, whole = least_squares_by_span(log.runs, signatures, np.array([~everywhere, everywhere])).T
    best = int(np.argmin(whole))
    beside = least_squares_by_span(log.runs, signatures, acting, (signatures[best], everywhere))
    beside[[signature.cause.label in log.lasting for signature in signatures]] = np.inf
    before = float(none[best] if known else whole[best])
    misfit = (before / min(float(np.min(beside)), before) - 1.0) * log.readings / 2.0
    return misfit / tolerated_misfit(log.readings)


def in_span(drives: NDArray, first: int, end: int) -> NDArray:
    """Whether drives by number lie in a span, boolean, shaped as `drives`."""
    return (drives >= first) & (drives < end)


def _likeliest(
    signatures: Sequence[CauseSignature],
    squares: NDArray,
    spans: Sequence[tuple[int, int]],
    count: int,
    readings: int,
) -> dict[str, Span]:
    """The likeliest span of each cause; squares: (signatures, spans), count: of drives."""
    labels = [signature.cause.label for signature in signatures]
    return {
        label: likeliest_span(
            np.min(squares[[name == label for name in labels]], axis=0), spans, count, readings
        )
        for label in dict.fromkeys(labels)
    }


def likeliest_span(
    squares: NDArray, spans: Sequence[tuple[int, int]], count: int, readings: int
) -> Span:
    """The likeliest of the spans (first, end); squares: sum that a cause leaves in each, (spans,)."""
    kinds = ["whole" if s == (0, count) else "late" if s[1] == count else "mended" for s in spans]
    prior = np.array([np.log(KINDS[kind] / kinds.count(kind)) for kind in kinds])
    misfits = (squares / np.min(squares) - 1.0) * readings / 2.0
    chances = softmax(log_likelihoods(misfits, tolerated_misfit(readings)) + prior)
    # A drive without fitted openings makes ties: the shortest span has what shows the cause.
    lengths = [end - first for first, end in spans]
    best = min(range(len(spans)), key=lambda k: (-round(float(chances[k]), 6), lengths[k]))
    of_first = np.bincount([first for first, _ in spans], weights=chances, minlength=count)
    order = np.argsort(-of_first, kind="stable")
    likely = [spans[best][0], *order[: 1 + np.searchsorted(np.cumsum(of_first[order]), LEVEL)]]
    between = (int(min(likely)), int(max(likely)))
    return Span(*spans[best], float(chances[best]), kinds[best] == "whole", between)


def least_squares_by_span(
    runs: Sequence[LinearisedRun],
    signatures: Sequence[CauseSignature],
    spans: NDArray,
    beside: tuple[CauseSignature, NDArray] | None = None,
) -> NDArray:
    """Sum of squares that each cause leaves if it acts in one span only, (signatures, spans) [1].

    Args:
        runs: the model without a cause, linearised.
        signatures: of the causes beside it, in the same runs.
        spans: whether a run lies in each, boolean (spans, runs).
        beside: another cause that acts, too, of any size, and where: boolean (runs,).
    """
    further = [beside[0]] if beside else []
    changes = [signature.changes for signature in (*signatures, *further)]
    joint = [with_changes(run, [change[r] for change in changes]) for r, run in enumerate(runs)]
    grams = normal_equations(joint).runs.free()
    causes = 1 + runs[0].slopes.shape[1] + np.arange(len(signatures))
    others = np.setdiff1d(np.arange(1, grams.shape[1]), causes)
    shared = np.arange(causes[-1] + 1 + len(further), grams.shape[1])
    shares = np.array([signature.shares for signature in signatures])
    weights = np.ones(grams.shape[:2])
    if beside:
        weights[:, causes[-1] + 1] = beside[1]
    left = np.empty((len(signatures), len(spans)))
    for number, acting in enumerate(spans):
        weights[:, causes] = acting[:, None]
        gram = np.sum(grams * weights[:, :, None] * weights[:, None], axis=0)
        gram[shared, shared] += 1.0
        left[:, number] = _least(eliminated(gram, others, np.array([0, *causes])), shares)
    return left


def _least(gram: NDArray, shares: NDArray) -> NDArray:
    """Sum of squares with each cause alone, (causes,).

    gram: of residual and causes. shares: least and largest multiple of each signature, (causes, 2).
    """
    curvature = np.maximum(np.diag(gram)[1:], np.finfo(float).tiny)
    slope = gram[0, 1:]
    share = np.clip(slope / curvature, *shares.T)
    return gram[0, 0] - 2.0 * share * slope + share**2 * curvature
