"""Search for the causes: singles, then sets grown by one cause at a time, with their laws.

A cause is fitted with the law that the catalogue assumes and with an open law, side by side; the state
that the law follows promises most by linear prediction. The best sets get one law more, as long as it
pays.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.evidence import EvaluatedHypothesis, evaluate, misfit
from identification.gap.fit.fitting_problem import Estimate, FitCache, FittingProblem, Hypothesis
from identification.gap.fit.gauss_newton import fit, linearise
from identification.gap.fit.laws import MOST_LAWS
from identification.gap.fit.recalibration import with_own_nuisances
from identification.gap.fit.variable_projection import normal_equations
from identification.gap.plant import GreyBox
from identification.gap.search.law_screening import law_starts, over_reached_states
from identification.gap.search.posterior import Posterior, posterior, tolerated_misfit
from identification.gap.search.screening import (
    CauseSignature,
    best_start_of_each,
    screen_causes,
    simulate_signatures,
    simulated_starts,
    with_cause,
)

MOST_CAUSES = 4
"""Largest number of causes that are taken to act together."""

# Numbers for the sake of computing time.

MULTI_START_CAUSES = 12
"""Largest catalogue of which every cause is refitted from each of its trial values, and every pair:
causes may help together that do not help alone. A larger one begins at the most promising values."""

FINALISTS = 4
"""Best sets of one size that are fitted further, with nuisance slopes of their own and other laws."""

FIRST_ITERATIONS = 5
"""Most steps of the first fits: those of finalists go on."""


def is_small(plant: GreyBox) -> bool:
    """Whether the catalogue is small enough to begin at every trial value."""
    return len(plant.causes) <= MULTI_START_CAUSES


class HypothesisPool:
    """Refitted sets of causes; grows while the search goes on."""

    def __init__(self, problem: FittingProblem, recalibrated: EvaluatedHypothesis, cache: FitCache):
        """Begin with the model without causes."""
        self.problem = problem
        self.recalibrated = recalibrated
        self.cache = cache
        self.small = is_small(problem.plant)
        self.readings = sum(int(np.sum(run.trusted)) for run in problem.plant.runs)
        self.tolerated = tolerated_misfit(self.readings)
        self._least = misfit(recalibrated)
        self._best: dict[frozenset[str], EvaluatedHypothesis] = {}
        self._posterior: Posterior | None = None
        self._finished: set[str] = set()

    def add(self, estimates: Iterable[Estimate]) -> None:
        """Evaluate refitted estimates and keep the best of each set of causes."""
        self.keep(evaluate(self.problem, [each for each in estimates if not each.given_up]))

    def keep(self, found: Iterable[EvaluatedHypothesis]) -> None:
        """Keep each evaluated hypothesis that is better than the present one of its set."""
        for evaluated in found:
            self._least = min(self._least, misfit(evaluated))
            labels = frozenset(evaluated.labels)
            present = self._best.get(labels)
            if present is None or self._order(evaluated) < self._order(present):
                self._best[labels], self._posterior = evaluated, None

    def _order(self, evaluated: EvaluatedHypothesis) -> tuple[float, float]:
        """The less, the better; within noise the better fit counts."""
        return self._cost(evaluated), misfit(evaluated)

    def _cost(self, evaluated: EvaluatedHypothesis) -> float:
        """What counts when one of two fits of a set is kept [nats]: an open law must halve it.

        So the law of the catalogue is kept where it is about as good, and the two laws are left to those
        causes that need them. Where a fit leaves less than the stated noise, the noise is less.
        """
        noise = min(self._least / max(self.readings, 1), 1.0)
        left = max(0.5 * (misfit(evaluated) / noise - self.readings), 0.0)
        return (left + self.tolerated) * 2.0 ** len(evaluated.estimate.hypothesis.laws)

    def __contains__(self, labels: frozenset[str]) -> bool:
        """Whether a set of causes was refitted."""
        return labels in self._best

    def posterior(self) -> Posterior:
        """All hypotheses with causes, and their probabilities; weighed once for each change."""
        if self._posterior is None:
            self._posterior = posterior(self.problem, self.recalibrated, list(self._best.values()))
        return self._posterior

    def least_cost(self, number: int) -> float:
        """What the best set of a number of causes leaves, laws priced [nats]; infinity without one."""
        sets = (each for each in self._best.values() if len(each.labels) == number)
        return min((self._cost(each) for each in sets), default=np.inf)

    def much_is_left(self) -> bool:
        """Whether the best hypothesis leaves more than what no model is free of."""
        return min(self.posterior().misfits, default=0.0) > self.tolerated

    def promising(self, number: int, most: int) -> list[EvaluatedHypothesis]:
        """The best sets of a number of causes, but none that leaves ten times more than the best."""
        ranked = [each for each in self.posterior().hypotheses if len(each.labels) == number][:most]
        return [each for each in ranked if self._cost(each) <= 10.0 * self._cost(ranked[0])]

    def finish(self, number: int) -> None:
        """Fit the best sets of a number of causes further: own nuisances, then one law more.

        As long as a law pays and much is left, another one is opened.
        """
        best = self.promising(number, FINALISTS)
        for _ in range(1 + MOST_LAWS):
            best = [each for each in best if _name(each) not in self._finished]
            if not best:
                return
            self._finished |= {_name(each) for each in best}
            starts = [replace(e, estimate=over_reached_states(self.problem, e.estimate)) for e in best]
            name = f"further: {_names(best)}"
            best = with_own_nuisances(self.problem, starts, name, self.cache)
            self.keep(best)
            if not self.much_is_left():
                return
            self.keep(evaluate(self.problem, self._with_another_law(best)))
            best = self.promising(number, FINALISTS)

    def _with_another_law(self, chosen: Sequence[EvaluatedHypothesis]) -> list[Estimate]:
        """Fits of each of the best with those laws open that promise most."""

        def fits() -> list[Estimate]:
            starts = []
            for each in chosen:
                base, causes = each.estimate, each.estimate.hypothesis.causes
                runs = _most_misfitting(self.problem, dict(enumerate(each.residuals)))
                found = law_starts(self.problem, base, [base] * len(causes), causes, runs)
                starts += [start.estimate for start in found[:1]]
            return fit(self.problem, starts, iterations=FIRST_ITERATIONS)

        slopes = {frozenset(e.labels): self.problem.slopes_of(e.estimate) for e in chosen}
        found = self.cache(
            f"one law more: {_names(chosen)}", fits,
            lambda estimate: slopes[frozenset(estimate.hypothesis.labels)],
        )  # fmt: skip
        return [each for each in found if not each.given_up]


def _name(evaluated: EvaluatedHypothesis) -> str:
    """A hypothesis with its open laws, for the journal."""
    laws = evaluated.estimate.hypothesis.laws
    return ", ".join(
        [evaluated.label, *(f"law of {law.cause.label} over {law.argument}" for law in laws)]
    )


def _names(chosen: Sequence[EvaluatedHypothesis]) -> str:
    """Several hypotheses in one line, for the journal."""
    return "; ".join(_name(each) for each in chosen)


def search_causes(pool: HypothesisPool, base: Estimate, signatures: Sequence[CauseSignature]) -> None:
    """Refit the promising sets of causes into the pool.

    Args:
        pool: begins without causes.
        base: the recalibrated model.
        signatures: of all causes beside it.
    """
    _fit_beside(pool, base, signatures)
    if pool.small:
        # Without the cause recalibration may have ended in a corner, far from the truth.
        nominal = pool.problem.start(Hypothesis(causes=()), {})
        _fit_beside(pool, nominal, name="the nominal model")
    pool.finish(1)
    for number in range(2, MOST_CAUSES + 1):
        if not pool.much_is_left():
            break
        helped = pool.least_cost(number - 1) <= 0.8 * pool.least_cost(number - 2)
        if number > 2 and not pool.small and not helped:
            break  # the last cause has not removed a fifth
        for smaller in pool.promising(number - 1, 2):
            _fit_beside(pool, smaller.estimate)
        if number == 2 and pool.small:
            _fit_pairs(pool, base, signatures)
        pool.finish(number)
    _leave_causes_out(pool)


def _fit_beside(
    pool: HypothesisPool, base: Estimate, signatures: Sequence[CauseSignature] = (), name: str = ""
) -> None:
    """Fit a set with each of the most promising further causes, as assumed and with an open law.

    base: the set's estimate. signatures: of all causes beside it, where they are known. name: of the
    base where sets that were fitted are fitted again.
    """
    problem, hypothesis = pool.problem, base.hypothesis
    known = {cause.name for cause in hypothesis.causes}
    others = [
        cause
        for cause in problem.plant.causes
        if cause.name not in known and (name or frozenset((*hypothesis.labels, cause.label)) not in pool)
    ]
    if not others:
        return

    def fits() -> list[Estimate]:
        base_runs = linearise(problem, [base], problem.fitted_runs)[0]
        beside = signatures or simulate_signatures(problem, base, others)
        assumed = screen_causes(problem, base, base_runs, beside, every_start=pool.small)
        # Chi-squares of some of the runs are compared as shares of what the base leaves of them.
        residuals = dict(zip(problem.fitted_runs, (run.residual for run in base_runs), strict=True))
        runs = _most_misfitting(problem, residuals)
        estimates = [start.estimate for start in assumed]
        opened = law_starts(problem, base, estimates, [start.cause for start in assumed], runs)
        promise = {start.labels: start.chi_square / base.chi_square for start in reversed(assumed)}
        whole = normal_equations(
            [run for run, r in zip(base_runs, problem.fitted_runs, strict=True) if r in runs]
        ).chi_square
        for start in opened:
            share = start.chi_square / whole
            promise[start.labels] = min(promise.get(start.labels, np.inf), share)
        best = sorted(promise, key=lambda labels: promise[labels])
        kept = set(best if pool.small else best[:8])
        first, opened = ([s for s in part if s.labels in kept] for part in (assumed, opened))
        starts = [*(first if pool.small else best_start_of_each(first)), *best_start_of_each(opened)]
        return fit(problem, [s.estimate for s in starts], base.chi_square, iterations=FIRST_ITERATIONS)

    beside = f"beside {name or ' and '.join(hypothesis.labels) or 'nothing'}"
    pool.add(pool.cache(beside, fits, lambda estimate: problem.slopes_of(base)))


def _most_misfitting(problem: FittingProblem, residuals: Mapping[int, NDArray]) -> list[int]:
    """The fitted runs with the largest mean square residuals, up to half of all samples.

    residuals: by index of the run, of any shape [noise deviations].
    """
    squares = [float(np.mean(residuals[r] ** 2)) for r in problem.fitted_runs]
    lengths = {r: len(problem.plant.runs[r].time) for r in problem.fitted_runs}
    order = [problem.fitted_runs[i] for i in np.argsort(squares)[::-1]]
    before = np.cumsum([0, *(lengths[r] for r in order)])[:-1]
    return [r for r, b in zip(order, before, strict=True) if b < 0.5 * sum(lengths.values())]


def _fit_pairs(pool: HypothesisPool, base: Estimate, signatures: Sequence[CauseSignature]) -> None:
    """All pairs of a small catalogue."""
    problem = pool.problem

    def fits() -> list[Estimate]:
        base_runs = linearise(problem, [base], problem.fitted_runs)[0]
        screened = screen_causes(problem, base, base_runs, signatures)
        together = []
        for pair in combinations(screened, 2):
            if pair[0].cause.name != pair[1].cause.name:
                joint = base
                for start in pair:
                    values = problem.values(start.estimate)
                    sizes = {p.symbol: values[p.symbol] for p in start.cause.parameters}
                    joint = with_cause(problem, joint, start.cause, sizes)
                together.append(joint)
        starts = best_start_of_each(simulated_starts(problem, base, base_runs, together))
        return fit(problem, [start.estimate for start in starts], base.chi_square)

    pool.add(pool.cache("pairs", fits, lambda estimate: problem.slopes_of(base)))


def _leave_causes_out(pool: HypothesisPool) -> None:
    """Refit the best set without each of its causes, from its estimate, while that is better.

    Far from its true value a cause may get stuck where a larger set does not.
    """
    problem = pool.problem
    for _ in range(MOST_CAUSES - 1):
        ranked = pool.posterior().hypotheses
        if not ranked or len(ranked[0].labels) < 2:
            return
        best = ranked[0]
        values, hypothesis = problem.values(best.estimate), best.estimate.hypothesis
        starts = []
        for causes in combinations(hypothesis.causes, len(hypothesis.causes) - 1):
            laws = tuple(law for law in hypothesis.laws if law.cause in causes)
            starts.append(problem.start(Hypothesis(causes=causes, laws=laws), values))
        name = f"without one of {' and '.join(best.labels)}"
        found = pool.cache(name, lambda starts=starts: fit(problem, starts), problem.slopes_of)
        pool.add(found)
        pool.finish(len(hypothesis.causes) - 1)
        if pool.posterior().hypotheses[0].labels == best.labels:
            return
