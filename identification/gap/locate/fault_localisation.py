"""Fault localisation: the channel and regime of the gap, and the equation that lacks a term."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.fit.hypothesis import Estimate
from identification.gap.locate.forcing import LocalisationDesign, quadratic_forms
from identification.gap.locate.forcing_processes import (
    FREE,
    SLOW,
    ProcessFit,
    average_log_evidence,
    fit_processes,
)
from identification.gap.locate.regime_gaps import RegimeGap, regime_gaps, regimes_of
from identification.gap.locate.settings import LocalisationSettings
from identification.gap.locate.windows import Window, most_misfitting_runs
from identification.gap.model.state_equation import StateEquation
from identification.gap.model.time_scale import time_scale
from identification.gap.reduce.settings import ReductionSettings


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


def locate(
    problem: FittingProblem,
    estimate: Estimate,
    residuals: Sequence[NDArray],
    seed: int,
    settings: LocalisationSettings | None = None,
    bootstrap: ReductionSettings | None = None,
) -> Localisation:
    """Locate what a model, recalibrated or with causes, leaves unexplained.

    Args:
        problem: the plant with its readings.
        estimate: the model.
        residuals: its residuals, per run (channels, samples) [noise deviations], nuisance parameters
            accounted for.
        seed: of the bootstrap of the regimes' gaps.
        settings: judgement of the localisation; None: the defaults.
        bootstrap: settings of the intervals; None: the defaults.
    """
    settings, bootstrap = settings or LocalisationSettings(), bootstrap or ReductionSettings()
    plant, values = problem.plant, problem.candidate(estimate)
    masks = [regimes_of(plant, values, r) for r in problem.all_runs]
    runs = most_misfitting_runs(problem, residuals, settings)
    scale = time_scale(plant)
    design, forms = quadratic_forms(problem, estimate, runs, scale, settings)
    fits = fit_processes(forms, design, settings)
    evidence = np.array([average_log_evidence(own) for own in fits])
    priors = [1.0 if form.windows else settings.prior_reading for form in forms]
    weights = _probabilities(evidence, priors, settings)
    order = np.argsort(-evidence, kind="stable")
    likeliest = fits[int(np.argmax(weights[:-1]))]
    missing = weights[-1] < np.max(weights[:-1])
    return Localisation(
        channel_gaps=_channel_gaps(problem, residuals),
        regime_gaps=regime_gaps(plant, masks, residuals, seed, settings, bootstrap, scale),
        equation_probabilities={equation.name: 0.0 for equation in plant.equations}
        | {form.equation.name: float(w) for form, w in zip(forms, weights[:-1], strict=True)},
        nothing_missing=float(weights[-1]),
        forcings=[_forcing_estimate(fits[i][0], float(evidence[i]), design) for i in order],
        missing_term=_missing_term(likeliest, design.units) if missing else None,
    )


def _probabilities(
    evidence: NDArray, priors: Sequence[float], settings: LocalisationSettings
) -> NDArray:
    """Probability of each place (places,) and, last, that nothing is missing.

    evidence: log evidence of each place, (places,). priors: relative probability before any data.
    """
    largest = max(float(np.max(evidence)), 0.0)
    doubt = max(1.0, settings.evidence_doubt * np.sqrt(largest))
    nothing = settings.prior_nothing
    prior = (1 - nothing) * np.array(priors) / np.sum(priors)
    score = np.append(evidence / doubt + np.log(prior), np.log(nothing))
    weights = np.exp(score - np.max(score))
    return weights / np.sum(weights)


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
