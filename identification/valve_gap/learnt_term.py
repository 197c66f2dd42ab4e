"""What has no name, learnt: a function of one state on one equation that plants simulate.

It is placed where forcings say that it explains most of the fitted recordings. Its knots are then fitted
by simulation beside the parameters of the plant, as tolerances with a wide prior.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.stats import chi2

from epv_env.plant.effects.learnt import EQUATIONS, KNOT_SYMBOLS, KNOTS, STATES, LearntTerm, placed
from epv_env.plant.parameters import Parameters
from epv_env.plant.region import Region
from identification.block_bootstrap import Interval
from identification.gap.diagnosis import Diagnosis
from identification.gap.evidence import evaluate
from identification.gap.fitting_problem import Estimate, FittingProblem, NuisanceSlopes
from identification.gap.forcing import (
    LocalisationDesign,
    QuadraticForm,
    most_misfitting_runs,
    quadratic_forms,
)
from identification.gap.gaps import GapDraws
from identification.gap.gauss_newton import fit, linearise, nuisance_slopes
from identification.gap.held_out import RECALIBRATED
from identification.gap.localisation import (
    FREE,
    ROUGH_VARIANCE,
    STATE_LENGTH,
    IdentifiableSubspace,
    fit_process,
)
from identification.gap.plant import GreyBox, NuisanceParameter
from identification.gap.prediction import predict
from identification.gap.prepared_plant import PreparedPlant, prepared
from identification.gap.quantities import gap_text, share_text
from identification.gap.recalibration import restarted
from identification.gap.time_scale import time_scale
from identification.gap.variable_projection import normal_equations, shared_as_slopes
from identification.gap.verdict import PARTIAL, UNKNOWN
from identification.replay.replay import Replay
from identification.valve_gap.valve import Valve

ROUNDS, STEPS_OF_A_ROUND = 4, 4
"""Rounds in which the answer to the knots is taken anew, and most steps of the parameters in between."""

SHORTENED = (1.0, 0.5, 0.2, 0.05)
"""Shares of a step that are tried [1]: outputs are not linear in a term that moves a switching."""

ENOUGH = 0.01
"""Relative decrease of the misfit by a round, below which the fit ends [1]."""

TRIED_PLACES = 3
"""Most places at which a term is fitted by simulation; computing time."""

KEPT, LEARNT = "kept", "learnt"
"""Labels of the models that are compared."""

_APART = np.subtract.outer(np.arange(KNOTS), np.arange(KNOTS)) / ((KNOTS - 1) * STATE_LENGTH)
SMOOTH = np.linalg.cholesky(np.exp(-0.5 * _APART**2) + ROUGH_VARIANCE * np.eye(KNOTS))
"""Knots from independent numbers, as smooth as the forcings of the localisation."""


@dataclass(frozen=True, kw_only=True)
class Place:
    """Where a term may act, and what the linear answer to forcings says of it."""

    equation: str
    state: str
    low: float
    """State at the first knot [SI]."""
    high: float
    """State at the last one [SI]."""
    size: float
    """Of the term [unit of EQUATIONS]."""
    log_evidence: float
    """Natural logarithm, relative to no term."""


class WithTerm(PreparedPlant):
    """A prepared plant with a term, whose last tolerances are independent numbers behind the knots."""

    def __init__(self, plant: GreyBox, valve: Valve, place: Place):
        """Begin with a term of zeros."""
        vars(self).update(vars(prepared(plant)))
        where = placed(place.equation, place.state, place.low, place.high)
        self.place, self.plant = place, copy(valve)
        self.plant.base = valve.base.replace(**where)
        self.plant.replay = Replay(valve.replay.drives, self.plant.base)
        numbers = (NuisanceParameter(symbol=s, sd=1.0, step=0.02) for s in KNOT_SYMBOLS)
        self.tolerances = (*plant.tolerances, *numbers)

    def outputs(self, values: Mapping[str, NDArray], runs: Sequence[int]) -> list[NDArray]:
        """`GreyBox.outputs`: per run (channels, samples, n) [SI]."""
        knots = self.place.size * SMOOTH @ np.array([values[symbol] for symbol in KNOT_SYMBOLS])
        return super().outputs({**values, **dict(zip(KNOT_SYMBOLS, knots, strict=True))}, runs)


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """A plant with a term, fitted by simulation."""

    problem: FittingProblem
    place: Place
    estimate: Estimate
    """With slopes at its own tolerances."""
    misfit: float
    """Sum of squares on the fitted runs and of the tolerances [1]."""


@dataclass(frozen=True, kw_only=True)
class LearntModel:
    """The plant with a learnt term, judged on recordings never fitted to."""

    term: LearntTerm
    parameters: dict[str, float]
    """All that was fitted, the term's own parameters included, by symbol [SI]."""
    symbols: tuple[str, ...]
    """Calibrated parameters, those of causes, and the knots."""
    covariance: NDArray
    """Of these as fitted together (symbols, symbols) [SI]."""
    gap: Interval
    """With the term [noise deviations]."""
    closed: Interval
    """Share of the explainable gap that the plant closes with the term and its causes [1]."""

    @property
    def entry(self) -> dict[str, Any]:
        """Field `learnt_term` of gap.json."""
        return {
            "equation": self.term.equation,
            "state": self.term.state,
            "shrink": {"fraction": self.closed.value, "low": self.closed.low, "high": self.closed.high},
            "remainder_closed": list(self.term.share_closed),
            "gap": self.gap.value,
        }

    def sentence(self, found: Diagnosis) -> str:
        """How much the term closes, beside the black box."""
        value, low, high = self.term.share_closed
        closes = share_text(Interval(value=value, low=low, high=high))
        black_box = gap_text(found.reduction.black_box.overall.value)
        return (
            f"A term learnt on {self.term.equation} over {self.term.state}, which names no cause, "
            f"closes {closes} of this on recordings never fitted to: their gap is "
            f"{gap_text(self.gap.value)} with it and {black_box} with the black box. The plant file "
            "holds it."
        )

    def region(self, centre: Parameters, probability: float) -> Region:
        """Where the recordings leave parameters and knots, jointly; centre: what was not fitted."""
        inside = {s: float(np.clip(v, *centre.domain(s))) for s, v in self.parameters.items()}
        return Region(
            centre=centre.replace(**inside),
            symbols=self.symbols,
            covariance=self.covariance,
            chi_square=float(chi2.ppf(probability, len(self.symbols))),
        )


def learn(found: Diagnosis, valve: Valve, seed: int = 0) -> LearntModel | None:
    """The term that models what a diagnosis leaves.

    None where nothing is left, where the readings are at fault, or where no term surely helps.
    """
    location = found.remaining or found.localisation
    left = found.conclusion.verdict in (PARTIAL, UNKNOWN) and location.missing_term
    if not left or valve.base["learnt_equation"]:
        return None
    problem, estimate = found.ranking.problem, found.kept.estimate
    # As a plant simulates it: modes of form are no part of it.
    slopes = replace(problem.slopes_of(estimate), forms=None)
    estimate = replace(estimate, slopes=slopes, shares=None)
    places = find_places(problem, estimate, found.kept.residuals)[:TRIED_PLACES]
    start = np.concatenate([found.kept.tolerances, np.zeros(KNOTS)])
    fitted = [fit_term(WithTerm(problem.plant, valve, place), estimate, start) for place in places]
    judged = (_judged(found, own, seed) for own in sorted(fitted, key=lambda own: own.misfit))
    return next((model for model in judged if model), None)


def find_places(
    problem: FittingProblem, estimate: Estimate, residuals: Sequence[NDArray]
) -> list[Place]:
    """Every equation and state, the best first, by the linear answer of fitted runs to forcings.

    residuals: per run (channels, samples) [noise deviations].
    """
    plant, values = problem.plant, problem.candidate(estimate)
    own = [np.zeros_like(r) if plant.runs[i].held_out else r for i, r in enumerate(residuals)]
    runs = [r for r in most_misfitting_runs(problem, own) if not plant.runs[r].held_out]
    design, forms = quadratic_forms(problem, estimate, runs, time_scale(plant))
    traces = [plant.states(values, r) for r in problem.fitted_runs]
    places = []
    for state in STATES:
        reached = np.concatenate([own[state].values for own in traces])
        ends = float(np.min(reached)), float(np.max(reached))
        if ends[0] < ends[1]:
            places += [_place(form, design, state, *ends) for form in forms if form.windows]
    return sorted(places, key=lambda place: -place.log_evidence)


def _place(
    form: QuadraticForm, design: LocalisationDesign, state: str, low: float, high: float
) -> Place:
    """A term of an equation over a state that reaches from `low` to `high` [SI]."""
    at = (np.array([window.states[state] for window in form.windows]) - low) / (high - low)
    hats = np.maximum(1.0 - np.abs((KNOTS - 1) * at[:, None] - np.arange(KNOTS)), 0.0) @ SMOOTH
    own = replace(form, precision=hats.T @ form.precision @ hats, moment=hats.T @ form.moment)
    found = fit_process(IdentifiableSubspace(own), design, FREE)
    step = form.equation.step / EQUATIONS[form.equation.name][1]
    return Place(
        equation=form.equation.name, state=state, low=low, high=high,
        size=float(np.sqrt(np.mean(found.forcing**2))) * step, log_evidence=found.log_evidence,
    )  # fmt: skip


def fit_term(plant: WithTerm, estimate: Estimate, start: NDArray) -> Fitted:
    """A term fitted to the fitted runs by Gauss-Newton steps, each as long as it helps.

    estimate: without the term. start: its tolerances and zeros, (m,) [standard deviations].
    """
    problem = FittingProblem(plant)
    best = as_simulated(estimate, start)
    least = _misfit(problem, best)
    for _ in range(ROUNDS):
        begin = replace(restarted(best), slopes=_slopes(problem, best))
        end = fit(problem, [begin], iterations=STEPS_OF_A_ROUND)[0]
        apart = evaluate(problem, [end])[0].tolerances - _deviations(best), end.vector - best.vector
        tried = [
            as_simulated(
                replace(end, vector=best.vector + share * apart[1]), _deviations(best) + share * apart[0]
            )
            for share in SHORTENED
        ]
        misfits = [_misfit(problem, each) for each in tried]
        gained = least - min(misfits)
        if gained > 0.0:
            best, least = tried[int(np.argmin(misfits))], min(misfits)
        if gained < ENOUGH * least:
            break
    estimate = replace(best, slopes=_slopes(problem, best))
    return Fitted(problem=problem, place=plant.place, estimate=estimate, misfit=least)


def _deviations(estimate: Estimate) -> NDArray:
    """Tolerances at which an estimate with slopes is simulated [standard deviations]."""
    assert estimate.slopes
    return estimate.slopes.deviations


def _slopes(problem: FittingProblem, estimate: Estimate) -> NuisanceSlopes:
    """Nuisance slopes at the estimate and its tolerances."""
    return nuisance_slopes(problem, [estimate], [_deviations(estimate)])[0]


def as_simulated(estimate: Estimate, deviations: NDArray) -> Estimate:
    """The estimate at these tolerances (m,), which nothing moves: what a plant file holds."""
    assert estimate.slopes
    still = [np.zeros((len(own), len(deviations))) for own in estimate.slopes.offset_slopes]
    slopes = replace(estimate.slopes, deviations=deviations, tolerance_slopes=still)
    return replace(estimate, slopes=slopes)


def _misfit(problem: FittingProblem, estimate: Estimate) -> float:
    """Sum of squares of the fitted runs as simulated, and of the tolerances [1]."""
    residuals = predict(problem, estimate).residuals
    squares = sum(np.sum(residuals[r] ** 2) for r in problem.fitted_runs)
    return float(squares + np.sum(_deviations(estimate) ** 2))


def _judged(found: Diagnosis, best: Fitted, seed: int) -> LearntModel | None:
    """The fitted term by what it closes on held-out runs; None where it may not help."""
    problem, deviations = found.ranking.problem, _deviations(best.estimate)
    simulated = as_simulated(best.estimate, deviations)
    residuals = {
        RECALIBRATED: predict(problem, found.ranking.recalibrated.estimate).residuals,
        KEPT: predict(problem, found.kept.estimate).residuals,
        LEARNT: predict(best.problem, simulated).residuals,
    }
    draws = GapDraws(problem.plant, residuals, seed, time_scale(problem.plant))
    closed = draws.share_closed(KEPT, LEARNT)
    if closed.low <= 0.0:
        return None
    covariance = covariance_of(best)
    term = term_of(best, covariance, closed)
    values = best.problem.candidates([simulated])
    fitted = best.problem.parameters(best.estimate)
    return LearntModel(
        term=term,
        symbols=(*(p.symbol for p in fitted), *KNOT_SYMBOLS),
        covariance=covariance,
        parameters={s: float(v[0]) for s, v in values.items() if v.ndim == 1} | term.parameters,
        gap=draws.gap(LEARNT).overall,
        closed=draws.share_closed(RECALIBRATED, LEARNT),
    )


def covariance_of(best: Fitted) -> NDArray:
    """Covariance of parameters and knots, of all that was fitted together (symbols, symbols) [SI].

    The misfit that is left widens it.
    """
    problem, count = best.problem, len(best.problem.plant.tolerances)
    runs = linearise(problem, [best.estimate], problem.fitted_runs)[0]
    hessian = normal_equations([shared_as_slopes(run) for run in runs]).hessian
    hessian[-count:, -count:] += np.eye(count)
    scales = [p.scale for p in problem.parameters(best.estimate)]
    own = np.r_[: len(scales), len(hessian) - KNOTS : len(hessian)]
    to_SI = np.asarray(block_diag(np.diag(scales), best.place.size * SMOOTH))
    inflation = max(1.0, best.misfit / problem.readings)
    covariance = inflation * to_SI @ np.linalg.pinv(hessian)[np.ix_(own, own)] @ to_SI.T
    return (covariance + covariance.T) / 2  # symmetric to the last digit


def term_of(best: Fitted, covariance: NDArray, closed: Interval) -> LearntTerm:
    """The term as plant files hold it. covariance: of `covariance_of` (symbols, symbols)."""
    place = best.place
    unit, state_unit = LearntTerm.units(place.equation, place.state)
    return LearntTerm(
        equation=place.equation, unit=unit, state=place.state, state_unit=state_unit, low=place.low,
        high=place.high,
        values=tuple((place.size * SMOOTH @ _deviations(best.estimate)[-KNOTS:]).tolist()),
        sd=tuple(np.sqrt(np.diag(covariance)[-KNOTS:]).tolist()),
        share_closed=(closed.value, closed.low, closed.high),
    )  # fmt: skip
