"""Which experiment next: the one with the highest expected information about the rival hypotheses.

A planned experiment is a run in which nothing has been measured yet (Bayesian experimental design:
Chaloner and Verdinelli 1995). Each rival predicts a Gaussian around its best fit. Noise, the open part
of the rival's parameters, and the run's own offsets give its width. So a difference that recalibration
within the posterior absorbs tells no rivals apart. Nor does a difference within the error of the forms,
which all rivals share: the experiment does not ask whether a form errs. In each short segment a cause's
effect may be off by a Gaussian random share, which is integrated out in closed form.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.special import log_softmax

from identification.gap.fitting_problem import (
    FAILED_RESIDUAL,
    Estimate,
    FittingProblem,
    cause_places,
    nominal_vector,
)
from identification.gap.gauss_newton import linearise, nuisance_slopes
from identification.gap.plant import GreyBox
from identification.gap.variable_projection import LinearisedRun, normal_equations, shared_as_slopes
from identification.gap.verdict import Ranking

MOST_RIVALS = 4
"""Most hypotheses between which an experiment is to decide; computing time."""

PROBABILITY_HELD_BY_RIVALS = 0.99
"""Share of the probability of all named hypotheses that the rivals hold [1]; at least two rivals."""

LEAST_VARIANCE = 1e-10
"""Variance of a direction of outcomes, relative to the widest one [1], below which the direction is left
out as rounding."""

OUTCOMES = 1000
"""Simulated outcomes of each rival over which an experiment is averaged: expected probabilities are then
known to 0.02 or better."""

FORM_ERROR, SEGMENT_DURATION = 0.1, 5e-3
"""Relative standard deviation by which a cause's effect may differ from our form in one segment [1]:
textbook forms are accurate to some percent. Duration of a segment [s]: about one transient."""


@dataclass(frozen=True, kw_only=True)
class Rivals:
    """Hypotheses between which an experiment is to decide, the most probable first."""

    estimates: tuple[Estimate, ...]
    probability: tuple[float, ...]
    """Before the experiment, (rivals,); sums to 1."""

    @property
    def titles(self) -> tuple[str, ...]:
        """Names for people."""
        return tuple(" + ".join(each.hypothesis.titles) or "no cause" for each in self.estimates)


@dataclass(frozen=True, kw_only=True)
class ParameterPosterior:
    """A Gaussian of an estimate's scaled vector, less its present value, and of all tolerances.

    k parameters [1] and m tolerances [standard deviations].
    """

    mean: NDArray
    """(k + m,)."""
    factor: NDArray
    """F of the covariance F F', (k + m, k + m)."""


@dataclass(frozen=True, kw_only=True)
class InformationGain:
    """What one experiment is expected to tell about n rivals."""

    expected_probability: tuple[float, ...]
    """Expected probability of each rival after the experiment, if that rival is right, (n,)."""
    expected_best: float
    """Expected probability, after the experiment, of the rival that is then the most probable."""
    expected_entropy: float
    """Expected entropy of the rivals' probabilities after the experiment [nats]."""
    log_bayes_factor: NDArray
    """Expected log Bayes factor of the right rival (row) against another (column), (n, n) [nats]."""

    @property
    def sort_key(self) -> tuple[float, float]:
        """Lower is better: the entropy; where none is left, the pair that is hardest to tell apart."""
        n = len(self.expected_probability)
        of_pairs = self.log_bayes_factor + np.diag(np.full(n, np.inf))
        return self.expected_entropy, -float(np.min(of_pairs))


def expected_information(
    problem: FittingProblem, plan: GreyBox, rivals: Rivals
) -> list[InformationGain]:
    """Expected information of each run of a plan; none where a rival cannot simulate the run.

    Args:
        problem: of the campaign, whose fitted runs give the rivals' posteriors.
        plan: the campaign's plant with the experiments as its runs; their readings are not used.
        rivals: hypotheses between which the experiment is to decide.
    """
    posteriors = parameter_posteriors(problem, rivals.estimates)
    planned, estimates = _planned_problem(problem, plan, rivals.estimates)
    predictions = linearise(planned, estimates, planned.all_runs)
    effects = _simulated_effects(planned, estimates, predictions)
    gains = []
    for r, run in enumerate(plan.runs):
        own = [runs[r] for runs in predictions]
        if any(np.any(line.residual == FAILED_RESIDUAL) for line in own):
            means, covariances = np.zeros((len(own), 1)), np.ones((len(own), 1, 1))
        else:
            channels, period = run.measured.shape[0], float(run.time[1])
            means, covariances = outcome_distributions(own, posteriors, effects[r], channels, period)
        gains.append(information_gain(means, covariances, rivals.probability, OUTCOMES))
    return gains


def _planned_problem(
    problem: FittingProblem, plan: GreyBox, estimates: Sequence[Estimate]
) -> tuple[FittingProblem, list[Estimate]]:
    """The plan with nuisance slopes at the first rival, and the rivals in the plan's runs."""
    planned = [_planned(estimate, plan) for estimate in estimates]
    rough = FittingProblem(plan, thorough=problem.thorough)
    slopes = nuisance_slopes(rough, planned[:1], [np.zeros(len(plan.tolerances))])[0]
    return FittingProblem(plan, slopes, thorough=problem.thorough), planned


def _planned(estimate: Estimate, plan: GreyBox) -> Estimate:
    """The estimate in the plan's runs, whose run parameters have their expected values."""
    centres = [nuisance.centre for nuisance in estimate.hypothesis.run_parameters]
    return replace(estimate, run_values=np.tile(np.array(centres), (len(plan.runs), 1)), slopes=None)


def _simulated_effects(
    planned: FittingProblem,
    estimates: Sequence[Estimate],
    predictions: Sequence[Sequence[LinearisedRun]],
) -> list[NDArray]:
    """Effects of all rivals' causes of uncertain form, per run (values, causes) [noise deviations].

    Each effect is the difference between simulations with and without the cause. A
    linear effect holds near the campaign; a planned run may drive the plant beyond it.
    """
    without, rivals = [], []
    for index, estimate in enumerate(estimates):
        for cause, place, _ in cause_places(estimate):
            if not cause.exact_form:
                vector = estimate.vector.copy()
                vector[place] = nominal_vector(cause)
                without.append(replace(estimate, vector=vector))
                rivals.append(index)
    if not without:
        return [np.zeros((len(measured), 0)) for measured in planned.measured]
    return [
        residuals - np.stack([predictions[index][r].residual for index in rivals], axis=1)
        for r, residuals in enumerate(planned.residuals(without, planned.all_runs))
    ]


def select_rivals(ranking: Ranking) -> Rivals:
    """The most probable hypotheses of a diagnosis, the recalibrated model among them."""
    named = [
        (hypothesis.estimate, probability)
        for hypothesis, probability in zip(ranking.hypotheses, ranking.probabilities, strict=True)
    ]
    named.append((ranking.recalibrated.estimate, ranking.no_cause))
    named.sort(key=lambda pair: -pair[1])
    total = max(sum(p for _, p in named), np.finfo(float).tiny)
    share = np.cumsum([p for _, p in named]) / total
    enough = np.searchsorted(share, PROBABILITY_HELD_BY_RIVALS) + 1
    count = int(np.clip(enough, 2, min(MOST_RIVALS, len(named))))
    chosen = np.array([p for _, p in named[:count]])
    chosen = chosen / np.sum(chosen) if np.any(chosen) else np.full(count, 1.0 / count)
    return Rivals(
        estimates=tuple(estimate for estimate, _ in named[:count]), probability=tuple(chosen.tolist())
    )


def parameter_posteriors(
    problem: FittingProblem, estimates: Sequence[Estimate]
) -> list[ParameterPosterior]:
    """Posteriors of the estimates, linearised, given the campaign's fitted runs.

    Before the data a parameter is uniform over its range; the Gaussian prior has that variance.
    """
    posteriors = []
    # The plan allows for errors of form by FORM_ERROR.
    estimates = [_without_modes(estimate) for estimate in estimates]
    linearised = linearise(problem, estimates, problem.fitted_runs)
    for estimate, runs in zip(estimates, linearised, strict=True):
        equations = normal_equations([shared_as_slopes(run) for run in runs])
        parameters = problem.parameters(estimate)
        widths = np.array([(p.high - p.low) / p.scale for p in parameters])
        prior = np.concatenate([12.0 / widths**2, np.ones(runs[0].shared_slopes.shape[1])])
        precision = equations.hessian + np.diag(prior)
        factor = np.linalg.inv(np.linalg.cholesky(precision)).T
        posteriors.append(
            ParameterPosterior(mean=factor @ (factor.T @ equations.gradient), factor=factor)
        )
    return posteriors


def _without_modes(estimate: Estimate) -> Estimate:
    """The estimate without modes of form."""
    slopes = estimate.slopes
    return replace(estimate, slopes=slopes and replace(slopes, forms=None), shares=None)


def outcome_distributions(
    runs: Sequence[LinearisedRun],
    posteriors: Sequence[ParameterPosterior],
    effects: NDArray,
    channels: int,
    period: float,
) -> tuple[NDArray, NDArray]:
    """Each rival's Gaussian of the outcome of one run.

    The d coordinates hold all predictions and their derivatives. Noise, errors of form included, is
    white and of unit variance in them; the first rival's mean is the origin.

    Args:
        runs: each rival's prediction, as a residual, and its derivatives.
        posteriors: of each rival's parameters.
        effects: effects of all rivals' causes of uncertain form, (values, causes) [noise deviations].
        channels: number of channels.
        period: of sampling [s].

    Returns:
        Means (rivals, d) and covariances (rivals, d, d) [1].
    """
    n = len(runs)
    slopes = [shared_as_slopes(run).slopes for run in runs]
    expected = [
        own @ posterior.mean - run.residual
        for run, own, posterior in zip(runs, slopes, posteriors, strict=True)
    ]
    means = np.stack(expected, axis=1) - expected[0][:, None]
    spreads = [
        np.column_stack([own @ posterior.factor, run.run_slopes * run.run_sd])
        for run, own, posterior in zip(runs, slopes, posteriors, strict=True)
    ]
    columns = np.column_stack([means, *spreads])
    gram = columns.T @ columns
    if effects.shape[1]:
        errors = FORM_ERROR / np.sqrt(n) * effects
        gram -= _explained_by_form_errors(columns, errors, channels, period)
    coordinates = _coordinates(gram)
    ends = np.cumsum([n, *(spread.shape[1] for spread in spreads)])
    own = np.split(coordinates, ends[:-1], axis=1)
    covariances = [np.eye(len(coordinates)) + spread @ spread.T for spread in own[1:]]
    return own[0].T, np.stack(covariances)


def _coordinates(gram: NDArray) -> NDArray:
    """Columns with these products (n, n) in the fewest coordinates, (d, n)."""
    values, vectors = np.linalg.eigh(gram)
    wide = values > LEAST_VARIANCE * values[-1]
    return np.sqrt(values[wide])[:, None] * vectors[:, wide].T


def _segments(columns: NDArray, length: int) -> NDArray:
    """Columns (samples, n) in segments, (segments, length, n), the last one zero-padded."""
    count = -(-len(columns) // length)
    padded = np.zeros((count * length, columns.shape[1]))
    padded[: len(columns)] = columns
    return padded.reshape(count, length, -1)


def _explained_by_form_errors(
    columns: NDArray, errors: NDArray, channels: int, period: float
) -> NDArray:
    """Part of the products of columns that errors of form explain, (n, n) [1].

    columns: predictions and derivatives, (channels x samples, n) [noise deviations]. errors: effects of
    causes times the size of their form error, (channels x samples, causes).
    """
    total = np.zeros((columns.shape[1], columns.shape[1]))
    length = max(1, round(SEGMENT_DURATION / period))
    for own_columns, own_errors in zip(
        np.split(columns, channels), np.split(errors, channels), strict=True
    ):
        parts, effects = _segments(own_columns, length), _segments(own_errors, length)
        gram = np.eye(effects.shape[2]) + effects.transpose(0, 2, 1) @ effects
        products = np.linalg.solve(np.linalg.cholesky(gram), effects.transpose(0, 2, 1) @ parts)
        flat = products.reshape(-1, products.shape[2])
        total += flat.T @ flat
    return total


def information_gain(
    means: NDArray, covariances: NDArray, probability: Sequence[float], outcomes: int
) -> InformationGain:
    """Expected information by simulated outcomes, in antithetic pairs.

    Args:
        means: of each rival's Gaussian, (rivals, d) [1].
        covariances: of each rival's Gaussian, (rivals, d, d) [1].
        probability: of each rival before the experiment, (rivals,).
        outcomes: number of simulated outcomes of each rival.
    """
    prior = np.array(probability)
    n, d = means.shape
    factors = np.linalg.cholesky(covariances)
    noise = np.random.default_rng(0).standard_normal((outcomes // 2, d))
    log_after = np.empty((n, 2 * len(noise), n))
    for right in range(n):
        spread = noise @ factors[right].T
        simulated = means[right] + np.concatenate([spread, -spread])
        likelihoods = [
            log_density(simulated - mean, factor) for mean, factor in zip(means, factors, strict=True)
        ]
        weighed = np.stack(likelihoods, axis=1) + np.log(np.maximum(prior, np.finfo(float).tiny))
        log_after[right] = log_softmax(weighed, axis=1)
    own = log_after[np.arange(n), :, np.arange(n)]
    return InformationGain(
        expected_probability=tuple(np.mean(np.exp(own), axis=1).tolist()),
        expected_best=float(prior @ np.mean(np.exp(np.max(log_after, axis=2)), axis=1)),
        expected_entropy=float(-prior @ np.mean(own, axis=1)),
        log_bayes_factor=kullback_leibler_divergences(means, factors),
    )


def log_density(deviations: NDArray, factor: NDArray) -> NDArray:
    """Log density of a Gaussian but for a constant, (draws,) [nats].

    deviations: from the mean, (draws, d) [1]. factor: Cholesky factor of the covariance, (d, d) [1].
    """
    white = solve_triangular(factor, deviations.T, lower=True)
    return -0.5 * np.sum(white**2, axis=0) - np.sum(np.log(np.diag(factor)))


def kullback_leibler_divergences(means: NDArray, factors: NDArray) -> NDArray:
    """Divergences of Gaussians, of each (row) from each other (column), (n, n) [nats].

    means: (n, d) [1]. factors: Cholesky factors of the covariances, (n, d, d) [1].
    """
    n, d = means.shape
    divergences = np.zeros((n, n))
    for right in range(n):
        for other in range(n):
            spread = solve_triangular(factors[other], factors[right], lower=True)
            of_mean = log_density((means[right] - means[other])[None], factors[other])[0]
            own = -np.sum(np.log(np.diag(factors[right])))
            divergences[right, other] = own - of_mean + 0.5 * (np.sum(spread**2) - d)
    return divergences


def odds_text(probability: float) -> str:
    """A probability as odds in a hundred: 98:2."""
    if probability > 0.99:
        return "better than 99:1"
    return f"{round(100 * probability)}:{100 - round(100 * probability)}"
