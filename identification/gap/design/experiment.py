"""Which experiment next: the one that best tells rival hypotheses apart, and with what odds.

A planned experiment is a run of a grey box in which nothing has been measured yet. Each rival predicts a
Gaussian: around what it gives at its best fit, as wide as noise, what the campaign leaves open of its
numbers and what every run has its own of make it. So a difference that recalibration within the
posterior absorbs tells nobody apart. Nor does one within the error of the forms (evidence.py), which all
rivals are given alike: whether a form errs is not what the experiment asks.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.gap.design.information_gain import Outlook, outlook
from identification.gap.fit.fitter import LOST, Fitter, Point, frames
from identification.gap.fit.variable_projection import Linear, normal
from identification.gap.model.grey_box import GreyBox
from identification.gap.rank.evidence import FORM_ERRORS, stretches
from identification.gap.rank.ranking import Verdicts

THIN = 1e-10
"""Share of the widest direction below which directions in the space of outcomes are left out."""

ENOUGH = 0.99
MOST = 4
"""Rivals are the most probable hypotheses: two at least, MOST at most, ENOUGH of what has a name."""


@dataclass(frozen=True, kw_only=True)
class Rivals:
    """Hypotheses between which an experiment is to decide, the most probable first."""

    points: tuple[Point, ...]
    probability: tuple[float, ...]
    """Before the experiment; sums to 1."""

    @property
    def names(self) -> tuple[str, ...]:
        """As people read them."""
        return tuple(" + ".join(point.hypothesis.name) or "no cause" for point in self.points)


@dataclass(frozen=True, kw_only=True)
class Posterior:
    """A Gaussian of a point's scaled vector, less its present value, and of all tolerances, in
    standard deviations, (k + m)."""

    mean: NDArray
    factor: NDArray
    """F of the covariance F F'."""


def rivals_of(verdicts: Verdicts) -> Rivals:
    """The most probable hypotheses of a diagnosis, the recalibrated model among them."""
    named = [
        (found.point, p) for found, p in zip(verdicts.candidates, verdicts.probability, strict=True)
    ]
    named.append((verdicts.none.point, verdicts.no_cause))
    named.sort(key=lambda pair: -pair[1])
    share = np.cumsum([p for _, p in named]) / max(sum(p for _, p in named), np.finfo(float).tiny)
    count = int(np.clip(np.searchsorted(share, ENOUGH) + 1, 2, min(MOST, len(named))))
    chosen = np.array([p for _, p in named[:count]])
    chosen = chosen / np.sum(chosen) if np.any(chosen) else np.full(count, 1.0 / count)
    return Rivals(points=tuple(point for point, _ in named[:count]), probability=tuple(chosen.tolist()))


def outlooks(fitter: Fitter, plan: GreyBox, rivals: Rivals) -> list[Outlook]:
    """What each run of a plan promises.

    fitter: of the campaign, at whose fitted runs the rivals' posteriors are taken. plan: the campaign's
    plant with the experiments as its runs; what they measured is not looked at. A run that one of the
    rivals cannot simulate promises nothing.
    """
    known = posteriors(fitter, rivals.points)
    points = [_planned(point, plan) for point in rivals.points]
    none = np.zeros(len(plan.tolerances))
    planned = Fitter(plan, frames(Fitter(plan), points[:1], [none])[0])
    predictions = planned.linearise(points, planned.everything)
    effects = _effects(planned, points, predictions)
    found = []
    for r, run in enumerate(plan.runs):
        own = [lines[r] for lines in predictions]
        if any(np.any(line.residual == LOST) for line in own):
            means, covariances = np.zeros((len(own), 1)), np.ones((len(own), 1, 1))
        else:
            channels, period = run.measured.shape[0], run.time[1]
            means, covariances = gaussians(own, known, effects[r], channels, period)
        found.append(outlook(means, covariances, rivals.probability))
    return found


def posteriors(fitter: Fitter, points: Sequence[Point]) -> list[Posterior]:
    """What the campaign's fitted runs say of each point's numbers.

    Before the data a number of the vector is spread evenly over its range.
    """
    found = []
    for point, runs in zip(points, fitter.linearise(points, fitter.fitted), strict=True):
        together = normal([_with_tolerances(run) for run in runs])
        sizes = (*fitter.plant.parameters, *point.hypothesis.sizes)
        widths = np.array([(size.high - size.low) / size.scale for size in sizes])
        prior = np.concatenate([12.0 / widths**2, np.ones(runs[0].shared.shape[1])])
        precision = together.hessian + np.diag(prior)
        factor = np.linalg.inv(np.linalg.cholesky(precision)).T
        found.append(Posterior(mean=factor @ (factor.T @ together.gradient), factor=factor))
    return found


def _with_tolerances(run: Linear) -> Linear:
    """The run with its tolerances among what is fitted."""
    slopes = np.column_stack([run.slopes, run.shared])
    return replace(run, slopes=slopes, shared=np.zeros((len(run.residual), 0)))


def gaussians(
    runs: Sequence[Linear],
    known: Sequence[Posterior],
    effects: NDArray,
    channels: int,
    period: float,
) -> tuple[NDArray, NDArray]:
    """Each rival's means (rivals, d) and covariances (rivals, d, d) of the outcome of one run.

    In coordinates that hold all predictions and their derivatives and in which noise, errors of form
    included, is white and of unit size; the first rival's mean is the origin.

    runs: each rival's prediction (as a residual) and its derivatives. known: of their numbers.
    effects: changes (values, causes) by all rivals' causes of uncertain form.
    """
    n = len(runs)
    numbers = [_with_tolerances(run).slopes for run in runs]
    expected = [
        slopes @ own.mean - run.residual for run, slopes, own in zip(runs, numbers, known, strict=True)
    ]
    means = np.stack(expected, axis=1) - expected[0][:, None]
    spreads = [
        np.column_stack([slopes @ own.factor, run.local * run.local_sd])
        for run, slopes, own in zip(runs, numbers, known, strict=True)
    ]
    columns = np.column_stack([means, *spreads])
    gram = columns.T @ columns
    if effects.shape[1]:
        gram -= _absorbed(columns, max(FORM_ERRORS) / np.sqrt(n) * effects, channels, period)
    values, vectors = np.linalg.eigh(gram)
    wide = values > THIN * values[-1]
    placed = np.sqrt(values[wide])[:, None] * vectors[:, wide].T
    ends = np.cumsum([n, *(spread.shape[1] for spread in spreads)])
    own = np.split(placed, ends[:-1], axis=1)
    covariances = [np.eye(len(placed)) + spread @ spread.T for spread in own[1:]]
    return own[0].T, np.stack(covariances)


def _planned(point: Point, plan: GreyBox) -> Point:
    """The point in the plan's runs, whose own numbers nobody knows yet."""
    centres = [nuisance.centre for nuisance in point.hypothesis.local]
    return replace(point, local=np.tile(np.array(centres), (len(plan.runs), 1)), frame=None)


def _effects(
    fitter: Fitter, points: Sequence[Point], predictions: Sequence[Sequence[Linear]]
) -> list[NDArray]:
    """What each point's causes of uncertain form change in each run, (values, causes)."""
    without, of = [], []
    for index, point in enumerate(points):
        column = point.first_size
        for cause in point.hypothesis.causes:
            vector = point.vector.copy()
            for size in cause.sizes:
                vector[column] = size.off / size.scale
                column += 1
            if not cause.exact:
                without.append(replace(point, vector=vector))
                of.append(index)
    if not without:
        return [np.zeros((len(target), 0)) for target in fitter.target]
    off = fitter.residuals(without, fitter.everything)
    return [
        block - np.stack([predictions[index][r].residual for index in of], axis=1)
        for r, block in enumerate(off)
    ]


def _absorbed(columns: NDArray, form: NDArray, channels: int, period: float) -> NDArray:
    """What errors of form, of a size of their own in every stretch, take from the columns' products."""
    total = np.zeros((columns.shape[1], columns.shape[1]))
    for mine, error in zip(np.split(columns, channels), np.split(form, channels), strict=True):
        c_b = np.stack([stretches(column, period) for column in mine.T], axis=2)
        u_b = np.stack([stretches(column, period) for column in error.T], axis=2)
        own = np.eye(u_b.shape[2]) + u_b.transpose(0, 2, 1) @ u_b
        along = np.linalg.solve(np.linalg.cholesky(own), u_b.transpose(0, 2, 1) @ c_b)
        flat = along.reshape(-1, along.shape[2])
        total += flat.T @ flat
    return total
