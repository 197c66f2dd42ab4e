"""Search for the causes: a beam over sets of causes and their laws, grown by one cause or law at a time.

A cause is fitted with the law that the catalogue assumes and with an open law, side by side; the state
that the law follows promises most by linear prediction. What is fitted further is what is most probable
(`posterior.py`).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from epv_env.common.law_form import MOST_LAWS
from identification.gap.fit.evidence import EvaluatedHypothesis, evaluate, misfit
from identification.gap.fit.fitting_problem import Estimate, FitCache, FittingProblem, Hypothesis
from identification.gap.fit.gauss_newton import fit, linearise
from identification.gap.fit.recalibration import with_own_nuisances
from identification.gap.fit.variable_projection import normal_equations
from identification.gap.search.law_screening import law_starts, over_reached_states
from identification.gap.search.posterior import Posterior, posterior
from identification.gap.search.screening import (
    CauseSignature,
    best_pairs,
    best_start_of_each,
    screen_causes,
    simulate_signatures,
    simulated_starts,
    with_cause,
)

MOST_CAUSES = 4
"""Largest number of causes that are taken to act together."""

WIDTH = 4
"""Width of the beam: sets of one size, and hypotheses of that size, that are fitted further; laws that
are tried of the best one. Twice as many first causes, and pairs, are begun. For computing time."""

FIRST_ITERATIONS = 5
"""Most steps of the first fits, for computing time: those of finalists go on."""

Key = tuple[frozenset[str], frozenset[tuple[str, str]]]
"""Labels of the causes, and label and argument of each open law."""


class HypothesisPool:
    """Refitted hypotheses; grows while the search goes on."""

    def __init__(self, problem: FittingProblem, recalibrated: EvaluatedHypothesis, cache: FitCache):
        """Begin with the model without causes."""
        self.problem = problem
        self.recalibrated = recalibrated
        self.cache = cache
        self._found: dict[Key, EvaluatedHypothesis] = {}
        self._posterior: Posterior | None = None
        self._finished: set[Key] = set()

    def add(self, estimates: Iterable[Estimate]) -> None:
        """Evaluate refitted estimates, and keep the best fit of each hypothesis."""
        self.keep(evaluate(self.problem, [each for each in estimates if not each.given_up]))

    def keep(self, found: Iterable[EvaluatedHypothesis]) -> None:
        """Keep each evaluated hypothesis that fits better than the present one with the same laws."""
        for evaluated in found:
            key = _key(evaluated.estimate.hypothesis)
            present = self._found.get(key) if evaluated.labels else self.recalibrated
            if present is not None and misfit(evaluated) >= misfit(present):
                continue
            self._posterior = None
            if evaluated.labels:
                self._found[key] = evaluated
            else:
                self.recalibrated = evaluated

    def __contains__(self, hypothesis: Hypothesis) -> bool:
        """Whether a set of causes was refitted with these laws."""
        return _key(hypothesis) in self._found

    def posterior(self) -> Posterior:
        """All hypotheses with causes, and their probabilities; weighed once for each change."""
        if self._posterior is None:
            self._posterior = posterior(self.problem, self.recalibrated, list(self._found.values()))
        return self._posterior

    def much_is_left(self) -> bool:
        """Whether the best hypothesis leaves more than what no model is free of."""
        return self.posterior().much_is_left

    def ranked(self, number: int) -> list[EvaluatedHypothesis]:
        """Hypotheses of a number of causes, the most probable first."""
        return [each for each in self.posterior().hypotheses if len(each.labels) == number]

    def promising(self, number: int) -> list[EvaluatedHypothesis]:
        """The best hypotheses of a number of causes, and the best one of each of the best sets."""
        ranked = self.ranked(number)
        chosen = {id(each) for each in (*ranked[:WIDTH], *_best_of_sets(ranked)[:WIDTH])}
        return [each for each in ranked if id(each) in chosen]

    def bases(self, number: int) -> list[EvaluatedHypothesis]:
        """What sets of one cause more grow from: the two best sets, and the best one without its laws.

        A law may stand for a further cause.
        """
        best = _best_of_sets(self.ranked(number))[:2]
        if not best[0].estimate.hypothesis.laws:
            return best
        values, causes = self.problem.values(best[0].estimate), best[0].estimate.hypothesis.causes
        start = self.problem.start(Hypothesis(causes=causes), values)
        plain = self.cache(
            f"without laws: {_names(best[:1])}",
            lambda: fit(self.problem, [start], iterations=FIRST_ITERATIONS),
            self.problem.slopes_of,
        )
        return [*best, *evaluate(self.problem, plain)]

    def finish(self, number: int) -> None:
        """Fit the best hypotheses of a number of causes further, and open more laws while it pays."""
        for _ in range(1 + MOST_LAWS):
            best = [
                e for e in self.promising(number) if _key(e.estimate.hypothesis) not in self._finished
            ]
            if not best:
                return
            self._finished |= {_key(each.estimate.hypothesis) for each in best}
            starts = [replace(e, estimate=over_reached_states(self.problem, e.estimate)) for e in best]
            best = with_own_nuisances(self.problem, starts, f"further: {_names(best)}", self.cache)
            self.keep(best)
            if not self.much_is_left():
                return
            self.add(self._with_another_law(best))

    def _with_another_law(self, chosen: Sequence[EvaluatedHypothesis]) -> list[Estimate]:
        """Fits with one law more: the most probable one is tried with the most laws."""

        def fits() -> list[Estimate]:
            starts = []
            for rank, each in enumerate(chosen, start=1):
                base, causes = each.estimate, each.estimate.hypothesis.causes
                runs = _most_misfitting(self.problem, dict(enumerate(each.residuals)))
                found = law_starts(self.problem, base, [base] * len(causes), causes, runs)
                starts += [start.estimate for start in found[: max(WIDTH // rank, 1)]]
            distinct = {_key(start.hypothesis): start for start in reversed(starts)}
            return fit(self.problem, list(distinct.values()), iterations=FIRST_ITERATIONS)

        slopes = {frozenset(e.labels): self.problem.slopes_of(e.estimate) for e in chosen}
        return self.cache(
            f"one law more: {_names(chosen)}",
            fits,
            lambda estimate: slopes[frozenset(estimate.hypothesis.labels)],
        )


def _best_of_sets(ranked: Sequence[EvaluatedHypothesis]) -> list[EvaluatedHypothesis]:
    """The first hypothesis of each set of causes."""
    first: dict[frozenset[str], EvaluatedHypothesis] = {}
    for each in ranked:
        first.setdefault(frozenset(each.labels), each)
    return list(first.values())


def _key(hypothesis: Hypothesis) -> Key:
    """What tells a hypothesis from others."""
    laws = frozenset((law.cause.label, law.argument) for law in hypothesis.laws)
    return frozenset(hypothesis.labels), laws


def _names(chosen: Sequence[EvaluatedHypothesis]) -> str:
    """Hypotheses with their open laws in one line, for the journal."""
    return "; ".join(_name(each.estimate.hypothesis) for each in chosen)


def _name(hypothesis: Hypothesis) -> str:
    laws = (f"law of {law.cause.label} over {law.argument}" for law in hypothesis.laws)
    return ", ".join([" + ".join(hypothesis.labels), *laws])


def search_causes(pool: HypothesisPool, base: Estimate, signatures: Sequence[CauseSignature]) -> None:
    """Refit the promising sets of causes into the pool.

    Args:
        pool: begins without causes.
        base: the recalibrated model.
        signatures: of all causes beside it.
    """
    _fit_beside(pool, base, signatures)
    if pool.much_is_left():
        # Without the right cause a fit may end in a corner, far from the truth.
        _fit_beside(pool, pool.problem.nominal_start(), name="at nominal parameters")
        _with_parameters_of_the_best(pool)
    pool.finish(1)
    for number in range(2, MOST_CAUSES + 1):
        if not pool.much_is_left() or (number > 2 and not _last_cause_helped(pool, number - 1)):
            break
        for smaller in pool.bases(number - 1):
            _fit_beside(pool, smaller.estimate)
        if number == 2:
            _fit_pairs(pool, base, signatures)
        pool.finish(number)
    _leave_causes_out(pool)


def _last_cause_helped(pool: HypothesisPool, number: int) -> bool:
    """Whether the best fit with a number of causes leaves less by a fifth than that with one less.

    A second of four causes may hardly pay.
    """
    found = pool.posterior()
    pairs = zip(found.misfits, found.hypotheses, strict=True)
    left = {len(each.labels): m for m, each in sorted(pairs, key=lambda pair: -pair[0])}
    return left.get(number, np.inf) <= 0.8 * left[number - 1]


def _fit_beside(
    pool: HypothesisPool,
    base: Estimate,
    signatures: Sequence[CauseSignature] = (),
    name: str = "",
) -> None:
    """Fit a set with each of the most promising further causes, as assumed and with an open law.

    base: the set's estimate. signatures: of all causes beside it, where they are known. name: in the
    journal.
    """
    problem, hypothesis = pool.problem, base.hypothesis
    known = {cause.name for cause in hypothesis.causes}
    others = [
        cause
        for cause in problem.plant.causes
        if cause.name not in known
        and (not known or replace(hypothesis, causes=(*hypothesis.causes, cause)) not in pool)
    ]
    if not others:
        return

    def fits() -> list[Estimate]:
        base_runs = linearise(problem, [base], problem.fitted_runs)[0]
        beside = signatures or simulate_signatures(problem, base, others)
        assumed = screen_causes(problem, base, base_runs, beside)
        # Chi-squares of some of the runs are compared as shares of what the base leaves of them.
        residuals = dict(zip(problem.fitted_runs, (run.residual for run in base_runs), strict=True))
        runs = _most_misfitting(problem, residuals)
        # Beside other causes the finalists' laws alone are opened, for computing time.
        lawful = [] if hypothesis.causes else assumed
        estimates = [start.estimate for start in lawful]
        opened = law_starts(problem, base, estimates, [start.cause for start in lawful], runs)
        left = normal_equations(base_runs).chi_square
        promise = {start.labels: start.chi_square / left for start in reversed(assumed)}
        whole = normal_equations(
            [run for run, r in zip(base_runs, problem.fitted_runs, strict=True) if r in runs]
        ).chi_square
        for start in opened:
            share = start.chi_square / whole
            promise[start.labels] = min(promise.get(start.labels, np.inf), share)
        best = set(sorted(promise, key=lambda labels: promise[labels])[: 2 * WIDTH])
        starts = [s for s in (*assumed, *best_start_of_each(opened)) if s.labels in best]
        rival = min(left, pool.recalibrated.estimate.chi_square)
        return fit(problem, [s.estimate for s in starts], rival, iterations=FIRST_ITERATIONS)

    name = name or f"beside {_name(hypothesis) or 'nothing'}"
    pool.add(pool.cache(name, fits, lambda estimate: problem.slopes_of(base)))


def _most_misfitting(problem: FittingProblem, residuals: Mapping[int, NDArray]) -> list[int]:
    """The fitted runs with the largest mean square residuals, up to half of all samples.

    residuals: by index of the run, of any shape [noise deviations].
    """
    squares = [float(np.mean(residuals[r] ** 2)) for r in problem.fitted_runs]
    lengths = {r: len(problem.plant.runs[r].time) for r in problem.fitted_runs}
    order = [problem.fitted_runs[i] for i in np.argsort(squares)[::-1]]
    before = np.cumsum([0, *(lengths[r] for r in order)])[:-1]
    return [r for r, b in zip(order, before, strict=True) if b < 0.5 * sum(lengths.values())]


def _with_parameters_of_the_best(pool: HypothesisPool) -> None:
    """Fit no cause and the single ones next to the best one again, from its calibrated parameters."""
    problem, found = pool.problem, _best_of_sets(pool.ranked(1))[:WIDTH]
    if not found:
        return
    values = problem.values(found[0].estimate)
    best = {p.symbol: values[p.symbol] for p in problem.plant.parameters}
    starts = [problem.start(Hypothesis(causes=()), best)]
    for each in found[1:]:
        begun = problem.start(each.estimate.hypothesis, problem.values(each.estimate) | best)
        starts.append(replace(begun, slopes=each.estimate.slopes))
    slopes = {e.labels: problem.slopes_of(e.estimate) for e in found}
    pool.add(
        pool.cache(
            f"with parameters of the best: {_names(found)}",
            lambda: fit(problem, starts, iterations=FIRST_ITERATIONS),
            lambda estimate: slopes.get(estimate.hypothesis.labels, problem.slopes),
        )
    )


def _fit_pairs(pool: HypothesisPool, base: Estimate, signatures: Sequence[CauseSignature]) -> None:
    """The pairs that promise most together, by linear prediction: they may not help alone."""
    problem = pool.problem

    def fits() -> list[Estimate]:
        base_runs = linearise(problem, [base], problem.fitted_runs)[0]
        pairs = [
            with_cause(problem, with_cause(problem, base, *first), *second)
            for first, second in best_pairs(base_runs, signatures, 2 * WIDTH)
        ]
        new = [pair for pair in pairs if pair.hypothesis not in pool]
        starts = simulated_starts(problem, base, base_runs, new)
        return fit(problem, [start.estimate for start in starts], iterations=FIRST_ITERATIONS)

    pool.add(pool.cache("pairs", fits, lambda estimate: problem.slopes_of(base)))


def _leave_causes_out(pool: HypothesisPool) -> None:
    """Refit the best set without each of its causes, from its estimate, while that is better.

    Far from its true value a cause may get stuck where a larger set does not.
    """
    problem = pool.problem
    for _ in range(MOST_CAUSES):
        ranked = pool.posterior().hypotheses
        if not ranked:
            return
        best = ranked[0]
        values, hypothesis = problem.values(best.estimate), best.estimate.hypothesis
        starts = []
        for causes in combinations(hypothesis.causes, len(hypothesis.causes) - 1):
            laws = tuple(law for law in hypothesis.laws if law.cause in causes)
            starts.append(problem.start(Hypothesis(causes=causes, laws=laws), values))
        name = f"without one of {' and '.join(best.labels)}"
        pool.add(pool.cache(name, lambda starts=starts: fit(problem, starts), problem.slopes_of))
        if len(hypothesis.causes) == 1:
            return
        pool.finish(len(hypothesis.causes) - 1)
        if pool.posterior().hypotheses[0].labels == best.labels:
            return
