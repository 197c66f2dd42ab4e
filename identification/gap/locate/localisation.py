"""Fault localisation: the channel and regime of the gap, and the equation that lacks a term.

A missing term is a function of one state or varies in time. Each assumption is a Gaussian process over
the windows (Rasmussen and Williams 2006), whose evidence is averaged over a grid of amplitudes. Where a
forcing leaves more than noise, the remaining mean square replaces the noise variance. So an equation
that explains half of a large residual does not win by the size of the residual alone.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp, softmax

from identification.gap.fit.fitting_problem import Estimate, FittingProblem
from identification.gap.fit.gaps import RegimeGap, regime_gaps, regimes_of
from identification.gap.locate.forcing import (
    LocalisationDesign,
    QuadraticForm,
    Window,
    most_misfitting_runs,
    quadratic_forms,
)
from identification.gap.plant import StateEquation
from identification.gap.prepare.prepared_plant import time_scale

FREE, SLOW = "free", "slow"
"""Processes in time: independent windows, or neighbours alike. Other processes bear a state's name."""

ROUGH_VARIANCE = 1e-3
"""Variance by which single windows may depart from a smooth forcing, relative to the whole [1]."""

PRIOR_NOTHING = 0.9
"""Probability before any data that nothing is missing: only clear evidence names an equation."""


@dataclass(frozen=True, kw_only=True)
class MissingTerm:
    """The missing term of an equation over the state that explains it best, in units of reports."""

    equation: StateEquation
    state: str
    state_unit: str
    x: NDArray
    """State in each window, rising, (windows,) [state_unit]."""
    y: NDArray
    """Forcing as a function of the state, (windows,) [unit of the equation]."""
    sd: NDArray
    """Its standard deviation, (windows,) [unit of the equation]."""
    scatter: NDArray
    """Forcing that each window needs by itself, (windows,) [unit of the equation]."""
    explained: float
    """Share of the forcing's effect that the function alone has [1]; small where no one state explains
    the forcing."""


@dataclass(frozen=True, kw_only=True)
class ForcingEstimate:
    """The most likely forcing of one equation, or fault of the readings, that explains the residual."""

    equation: StateEquation
    log_evidence: float
    """Natural logarithm, relative to no forcing."""
    explained: float
    """Share of the misfit beyond noise that the forcing removes [1]; 0 where there is no misfit."""
    windows: list[Window]
    forcing: NDArray
    """(windows,) [unit of the equation]."""
    sd: NDArray
    """Its standard deviation, (windows,) [unit of the equation]."""


@dataclass(frozen=True, kw_only=True)
class Localisation:
    """Where the gap lies. `equation_probabilities` and `nothing_missing` sum to 1."""

    channel_gaps: Mapping[str, float]
    """Root mean square of (model - measured)/noise on held-out runs, by channel; 1 is the floor."""
    regime_gaps: list[RegimeGap]
    equation_probabilities: Mapping[str, float]
    """Probability that the missing physics lies there, by equation and fault of the readings."""
    nothing_missing: float
    """Probability that nothing is missing."""
    forcings: list[ForcingEstimate]
    """By falling evidence."""
    missing_term: MissingTerm | None
    """Of the likeliest equation; None where nothing is missing or the readings are at fault."""

    @property
    def likeliest(self) -> ForcingEstimate:
        """The forcing of the equation or fault with the highest probability."""
        return max(self.forcings, key=lambda f: self.equation_probabilities[f.equation.name])

    @property
    def component_probabilities(self) -> dict[str, float]:
        """Of the equations and readings of each component together."""
        total: dict[str, float] = {}
        for forcing in self.forcings:
            component, name = forcing.equation.component, forcing.equation.name
            total[component] = total.get(component, 0.0) + self.equation_probabilities[name]
        return total


@dataclass(frozen=True, kw_only=True)
class ProcessFit:
    """A Gaussian process fitted to the forcing of one equation."""

    form: QuadraticForm
    kind: str
    """FREE, SLOW, or the name of the state whose function the forcing is."""
    log_evidence: float
    """Natural logarithm, relative to no forcing."""
    explained: float
    """Share of chi-square that the forcing removes [1]."""
    forcing: NDArray
    """Posterior mean of the forcing, (windows,) [steps of the equation]."""
    sd: NDArray
    """Its posterior standard deviation, (windows,) [steps of the equation]."""
    smooth: NDArray
    """Posterior mean of its smooth part, without what single windows have of their own, (windows,)
    [steps of the equation]."""
    smooth_sd: NDArray
    """Posterior standard deviation of the smooth part, (windows,) [steps of the equation]."""
    smooth_explained: float
    """Share of chi-square that the smooth part removes alone [1]."""


class IdentifiableSubspace:
    """The d directions of an equation's forcings that the readings determine."""

    def __init__(self, form: QuadraticForm):
        """Keep the directions that are precise enough."""
        precision, axes = np.linalg.eigh(form.precision)
        # What is less precise is rounding, and no information.
        kept = precision > 1e-7 * max(precision[-1], np.finfo(float).tiny)
        self.form = form
        self.root = axes[:, kept] * np.sqrt(precision[kept])
        """Square root of the precision, precision = root root', (windows, d)."""
        self.moment = (axes[:, kept].T @ form.moment) / np.sqrt(precision[kept])
        """Moment of the whitened directions, (d,)."""


def locate(
    problem: FittingProblem, estimate: Estimate, residuals: Sequence[NDArray], seed: int
) -> Localisation:
    """Locate what a model, recalibrated or with causes, leaves unexplained.

    Args:
        problem: the plant with its readings.
        estimate: the model.
        residuals: its residuals, per run (channels, samples) [noise deviations], nuisance parameters
            accounted for.
        seed: of the bootstrap of the regimes' gaps.
    """
    plant, values = problem.plant, problem.candidate(estimate)
    masks = [regimes_of(plant, values, r) for r in problem.all_runs]
    runs = most_misfitting_runs(problem, residuals)
    scale = time_scale(plant)
    design, forms = quadratic_forms(problem, estimate, runs, scale)
    fits = fit_processes(forms, design)
    # The processes of an equation are equally likely before the data.
    evidence = np.array([logsumexp([f.log_evidence for f in own]) - np.log(len(own)) for own in fits])
    # Sensors are checked more often than physics.
    priors = [1.0 if form.windows else 0.3 for form in forms]
    weights = _probabilities(evidence, priors)
    order = np.argsort(-evidence, kind="stable")
    likeliest = fits[int(np.argmax(weights[:-1]))]
    missing = weights[-1] < np.max(weights[:-1])
    return Localisation(
        channel_gaps=_channel_gaps(problem, residuals),
        regime_gaps=regime_gaps(plant, masks, residuals, seed, scale),
        equation_probabilities={equation.name: 0.0 for equation in plant.equations}
        | {form.equation.name: float(w) for form, w in zip(forms, weights[:-1], strict=True)},
        nothing_missing=float(weights[-1]),
        forcings=[_forcing_estimate(fits[i][0], float(evidence[i]), design) for i in order],
        missing_term=_missing_term(likeliest, design.units) if missing else None,
    )


def _probabilities(evidence: NDArray, priors: Sequence[float]) -> NDArray:
    """Probability of each place (places,) and, last, that nothing is missing.

    evidence: log evidence of each place, (places,). priors: relative probability before any data.
    """
    largest = max(float(np.max(evidence)), 0.0)
    doubt = max(1.0, 0.5 * np.sqrt(largest))  # the assumed forms of a forcing are not exact
    prior = (1 - PRIOR_NOTHING) * np.array(priors) / np.sum(priors)
    return softmax(np.append(evidence / doubt + np.log(prior), np.log(PRIOR_NOTHING)))


def _channel_gaps(problem: FittingProblem, residuals: Sequence[NDArray]) -> dict[str, float]:
    """Gap by channel on held-out runs, or on all where none is held out [noise deviations]."""
    plant = problem.plant
    runs = [r for r, run in enumerate(plant.runs) if run.held_out] or problem.all_runs
    squares = np.sum([np.sum(residuals[r] ** 2, axis=1) for r in runs], axis=0)
    counts = np.sum([np.sum(plant.runs[r].trusted, axis=1) for r in runs], axis=0)
    gaps = np.sqrt(squares / np.maximum(counts, 1))
    return {channel.name: float(gap) for channel, gap in zip(plant.channels, gaps, strict=True)}


def _forcing_estimate(
    fit: ProcessFit, log_evidence: float, design: LocalisationDesign
) -> ForcingEstimate:
    """The forcing of a process in the unit of its equation."""
    equation = fit.form.equation
    gap = design.chi_square - design.readings
    share = fit.explained * design.chi_square / gap if gap > 0 and log_evidence > 0 else 0.0
    size = equation.step / equation.scale
    return ForcingEstimate(
        equation=equation,
        log_evidence=log_evidence,
        explained=min(share, 1.0),
        windows=fit.form.windows,
        forcing=size * fit.forcing,
        sd=size * fit.sd,
    )


def _missing_term(
    fits: Sequence[ProcessFit], units: Mapping[str, tuple[str, float]]
) -> MissingTerm | None:
    """The function of a state that explains most by itself; None where none was fitted."""
    of_states = [fit for fit in fits if fit.kind not in (FREE, SLOW)]
    if not of_states:
        return None
    fit = max(of_states, key=lambda fit: fit.smooth_explained)
    equation, (unit, scale) = fit.form.equation, units[fit.kind]
    size = equation.step / equation.scale
    x = np.array([window.states[fit.kind] for window in fit.form.windows]) / scale
    order = np.argsort(x, kind="stable")
    return MissingTerm(
        equation=equation,
        state=fit.kind,
        state_unit=unit,
        x=x[order],
        y=size * fit.smooth[order],
        sd=size * fit.smooth_sd[order],
        scatter=size * fit.forcing[order],
        explained=float(np.clip(fit.smooth_explained / fit.explained, 0.0, 1.0)),
    )


def fit_processes(forms: Sequence[QuadraticForm], design: LocalisationDesign) -> list[list[ProcessFit]]:
    """Every process for each equation, by falling evidence.

    Functions of states are tried only for equations that explain about as much as the best one.
    """
    subspaces = [IdentifiableSubspace(form) for form in forms]
    fits = [
        [fit_process(own, design, kind) for kind in ((FREE, SLOW) if own.form.windows else (FREE,))]
        for own in subspaces
    ]
    enough = 0.5 * max(own_fits[0].explained for own_fits in fits)
    for subspace, own_fits in zip(subspaces, fits, strict=True):
        if subspace.form.windows and own_fits[0].explained >= enough:
            own_fits += [fit_process(subspace, design, state) for state in design.units]
        own_fits.sort(key=lambda fit: -fit.log_evidence)
    return fits


def _covariance(form: QuadraticForm, kind: str) -> tuple[NDArray, float]:
    """Prior covariance of the smooth part (windows, windows), and variance of each window's own part."""
    count, windows = len(form.moment), form.windows
    if kind == FREE:
        return np.zeros((count, count)), 1.0
    if kind == SLOW:
        run = np.array([window.run for window in windows])
        time = np.array([0.5 * (window.begin + window.end) for window in windows])
        memory = 0.02 * max(window.end for window in windows)
        apart = np.abs(time[:, None] - time) / memory
        return np.where(run[:, None] == run, np.exp(-apart), 0.0), ROUGH_VARIANCE
    x = np.array([window.states[kind] for window in windows])
    # The smooth terms of physics bend once or twice over the range of a state.
    length = 0.2 * max(float(np.ptp(x)), np.finfo(float).tiny)
    distance = (x[:, None] - x) / length
    return np.exp(-0.5 * distance**2), ROUGH_VARIANCE


def fit_process(subspace: IdentifiableSubspace, design: LocalisationDesign, kind: str) -> ProcessFit:
    """Evidence averaged over the amplitudes, and the forcing at the most likely amplitude."""
    smooth, own = _covariance(subspace.form, kind)
    smooth_root = smooth @ subspace.root
    root = smooth_root + own * subspace.root
    strength, axes = np.linalg.eigh(subspace.root.T @ root)
    strength = np.maximum(strength, 0.0)
    moment = axes.T @ subspace.moment
    # Where no reading tells of this forcing every strength is 0, and any amplitude will do.
    # Variances from no effect to far beyond any gap, three per decade.
    amplitudes = np.logspace(-3.0, 9.0, 37) / (np.mean(strength) if np.any(strength) else 1.0)
    weights = amplitudes[:, None] / (1.0 + amplitudes[:, None] * strength)
    explained = (weights * strength) @ moment**2
    noise = np.maximum(1.0, (design.chi_square - explained) / design.readings)
    volume = np.sum(np.log1p(amplitudes[:, None] * strength), axis=1)
    evidence = _log_evidences(design, explained, noise, volume)
    best = int(np.argmax(evidence))
    weight, scale = weights[best], amplitudes[best] * noise[best]
    smooth_root, root = smooth_root @ axes, root @ axes
    curve = smooth_root @ (weight * moment)
    form, variance = subspace.form, np.diag(smooth)
    smooth_explained = (2 * form.moment - form.precision @ curve) @ curve / design.chi_square
    return ProcessFit(
        form=form,
        kind=kind,
        log_evidence=float(logsumexp(evidence) - np.log(len(evidence))),
        explained=float(explained[best] / design.chi_square),
        forcing=root @ (weight * moment),
        sd=np.sqrt(scale * np.maximum(variance + own - root**2 @ weight, 0.0)),
        smooth=curve,
        smooth_sd=np.sqrt(scale * np.maximum(variance - smooth_root**2 @ weight, 0.0)),
        smooth_explained=float(smooth_explained),
    )


def _log_evidences(
    design: LocalisationDesign, explained: NDArray, noise: NDArray, volume: NDArray
) -> NDArray:
    """Log evidence at each amplitude, relative to no forcing, (amplitudes,).

    explained: decrease of chi-square. noise: variance of what is left, at least 1. volume: log
    determinant of the prior's widening.
    """
    n, chi_square = design.readings, design.chi_square
    before = max(1.0, chi_square / n)
    return 0.5 * (
        chi_square / before - (chi_square - explained) / noise - n * np.log(noise / before) - volume
    )
