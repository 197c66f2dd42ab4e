"""Search for the causes: singles, then sets grown by one cause at a time and pruned again."""

from collections.abc import Iterable, Sequence
from itertools import combinations

from identification.gap.evidence import EvaluatedHypothesis, evaluate, misfit
from identification.gap.fitting_problem import Estimate, FitCache, FittingProblem, Hypothesis
from identification.gap.gauss_newton import fit, linearise
from identification.gap.plant import GreyBox
from identification.gap.posterior import Posterior, misfit_beyond_white_noise, posterior
from identification.gap.recalibration import refit, with_own_nuisances
from identification.gap.screening import (
    CauseSignature,
    Start,
    best_start_of_each,
    promising_causes,
    screen_causes,
    simulate_signatures,
    simulated_starts,
    with_cause,
)
from identification.gap.variable_projection import LinearisedRun

MOST_CAUSES = 4
"""Largest number of causes that are taken to act together."""

LITTLE_LEFT, LITTLE_SHARE = 15.0, 3e-3
"""Misfit beyond white noise up to which a set leaves little, in nats and as a share of the whole [1],
added: another cause can hardly be seen."""

# Numbers for the sake of computing time.

MULTI_START_CAUSES = 12
"""Largest catalogue of which every cause is refitted from each of its trial values, and every pair:
causes may help together that do not help alone. A larger one begins at the most promising values."""

REFITTED_CAUSES = 12
"""Single causes that are refitted, those with the least predicted chi-square."""

FINALISTS = 4
"""Best sets of one size that are fitted further, with slopes and modes of form of their own."""

BASES = 2
"""The best sets of one size to which another cause is added."""

PARTNERS = 5
"""Causes tried beside a set."""

SIMULATED_PER_PARTNER = 2
"""Causes of a large catalogue that are simulated beside a set for each that is refitted there."""

STARTS = 2
"""Starts from which a cause of a large catalogue is refitted, and a pair of a small one: the most
promising of all trial values. From one start a fit may end in a local minimum."""


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
        self.first_fits: dict[frozenset[str], Estimate] = {}
        """Estimate of each set before its refinement. Refined nuisance parameters follow what the set
        lacks; from the first fit another cause is seen better."""
        self._best: dict[frozenset[str], EvaluatedHypothesis] = {}
        self._refined: set[frozenset[str]] = set()

    def add(self, estimates: Iterable[Estimate]) -> None:
        """Evaluate refitted estimates and keep the best of each set of causes."""
        for evaluated in evaluate(self.problem, list(estimates)):
            labels = frozenset(evaluated.labels)
            if self._keep(evaluated):
                self.first_fits[labels] = evaluated.estimate

    def refine(self, number: int) -> None:
        """Fit the best sets of a number of causes further, with slopes and modes of their own."""
        ranked = [each for each, _ in self.ranked(number)[:FINALISTS]]
        best = [each for each in ranked if frozenset(each.labels) not in self._refined]
        name = f"modes of {number}: {', '.join(' and '.join(each.labels) for each in best)}"
        for refined in with_own_nuisances(self.problem, best, name, self.cache):
            self._refined.add(frozenset(refined.labels))
            self._best[frozenset(refined.labels)] = refined

    def _keep(self, evaluated: EvaluatedHypothesis) -> bool:
        """Keep a fit that is better than the present one of its set."""
        labels = frozenset(evaluated.labels)
        present = self._best.get(labels)
        better = present is None or misfit(evaluated) < misfit(present)
        if better:
            self._best[labels] = evaluated
        return better

    def __contains__(self, labels: frozenset[str]) -> bool:
        """Whether a set of causes was refitted."""
        return labels in self._best

    def posterior(self) -> Posterior:
        """All hypotheses with causes, and their probabilities."""
        return posterior(self.problem, self.recalibrated, list(self._best.values()))

    def ranked(self, number: int | None = None) -> list[tuple[EvaluatedHypothesis, float]]:
        """Hypotheses with a number of causes, or all, and their scores [nats], the best first."""
        found = self.posterior()
        pairs = [
            (each, score)
            for each, score in zip(found.hypotheses, found.scores, strict=True)
            if number is None or len(each.labels) == number
        ]
        return sorted(pairs, key=lambda pair: (-pair[1], misfit(pair[0])))


def search_causes(
    pool: HypothesisPool,
    base: Estimate,
    base_runs: Sequence[LinearisedRun],
    signatures: Sequence[CauseSignature],
    most_causes: int = MOST_CAUSES,
) -> None:
    """Refit the promising sets of causes into the pool.

    Args:
        pool: begins without causes.
        base: the recalibrated model.
        base_runs: the same linearised in the fitted runs.
        signatures: of all causes beside it.
        most_causes: largest number of causes of a set.
    """
    screened = screen_causes(pool.problem, base, base_runs, signatures, every_start=True)
    starts = screened if pool.small else _promising_starts(screened)
    pool.add(pool.cache("single causes", lambda: refit(pool.problem, base, starts)))
    pool.refine(1)
    for number in range(2, most_causes + 1):
        if not _another_cause_may_act(pool, number):
            break
        for smaller, _ in pool.ranked(number - 1)[:BASES]:
            pool.add(_fits_with_another(pool, smaller, signatures))
        if number == 2 and pool.small:
            _fit_pairs(pool, base, base_runs, screened)
        pool.refine(number)
    _leave_causes_out(pool)


def _promising_starts(screened: Sequence[Start]) -> list[Start]:
    """The best starts of the most promising causes."""
    first = best_start_of_each(screened)[:REFITTED_CAUSES]
    kept = {start.labels for start in first}
    return _best_starts([start for start in screened if start.labels in kept], STARTS)


def _another_cause_may_act(pool: HypothesisPool, number: int) -> bool:
    """Whether sets of `number` causes are worth a search: much is left, and the last cause helped.

    Where four causes act, the second one alone may hardly pay: the search goes on in a small catalogue,
    and where the gap has no name yet.
    """
    found = pool.posterior()
    every = [misfit_beyond_white_noise(each, found.discrepancies) for each in found.hypotheses]
    whole = misfit_beyond_white_noise(pool.recalibrated, found.discrepancies)
    if not every or min(every) <= LITTLE_LEFT + LITTLE_SHARE * whole:
        return False
    if pool.small or number == 2 or found.unknown > sum(found.probabilities):
        return True
    larger, smaller = pool.ranked(number - 1), pool.ranked(number - 2)
    return bool(larger) and larger[0][1] > smaller[0][1]


def _fits_with_another(
    pool: HypothesisPool, smaller: EvaluatedHypothesis, signatures: Sequence[CauseSignature]
) -> list[Estimate]:
    """Fits of a set with each of the most promising further causes.

    In a large catalogue those are simulated beside the set whose signatures promise something there.
    """
    problem = pool.problem
    base = pool.first_fits[frozenset(smaller.labels)]
    own = {cause.name for cause in base.hypothesis.causes}
    others = [
        signature
        for signature in signatures
        if signature.cause.name not in own
        and frozenset((*smaller.labels, signature.cause.label)) not in pool
    ]

    def fits() -> list[Estimate]:
        base_runs = linearise(problem, [base], problem.fitted_runs)[0]
        causes = promising_causes(problem, base_runs, others)
        if not pool.small:
            causes = causes[: SIMULATED_PER_PARTNER * PARTNERS]
        beside = simulate_signatures(problem, base, causes)
        screened = screen_causes(problem, base, base_runs, beside, every_start=pool.small)
        kept = screened if pool.small else screened[:PARTNERS]
        return refit(problem, base, kept)

    return pool.cache(f"beside {' and '.join(smaller.labels)}", fits) if others else []


def _fit_pairs(
    pool: HypothesisPool,
    base: Estimate,
    base_runs: Sequence[LinearisedRun],
    screened: Sequence[Start],
) -> None:
    """All pairs of a small catalogue."""
    problem = pool.problem
    together = [
        _both(problem, base, first, second)
        for first, second in combinations(screened, 2)
        if first.cause.name != second.cause.name
    ]

    def fits() -> list[Estimate]:
        starts = simulated_starts(problem, base, base_runs, together)
        return refit(problem, base, _best_starts(starts, STARTS))

    pool.add(pool.cache("pairs", fits))


def _both(problem: FittingProblem, base: Estimate, first: Start, second: Start) -> Estimate:
    """The base with the causes of two starts at their values there."""
    joint = base
    for start in (first, second):
        values, parameters = problem.values(start.estimate), start.cause.parameters
        joint = with_cause(problem, joint, start.cause, {p.symbol: values[p.symbol] for p in parameters})
    return joint


def _best_starts(starts: Sequence[Start], most: int) -> list[Start]:
    """The best starts of each set of causes, up to a number."""
    kept: list[Start] = []
    left = list(starts)
    for _ in range(most):
        best = best_start_of_each(left)
        kept += best
        taken = {id(start) for start in best}
        left = [start for start in left if id(start) not in taken]
    return kept


def _leave_causes_out(pool: HypothesisPool) -> None:
    """Refit the best set without each of its causes, from its estimate, while that is better.

    Far from its true value a cause may get stuck where a larger set does not.
    """
    problem = pool.problem
    for _ in range(MOST_CAUSES - 1):
        ranked = pool.ranked()
        if not ranked or len(ranked[0][0].labels) < 2:
            return
        best = ranked[0][0]
        values = problem.values(best.estimate)
        causes = best.estimate.hypothesis.causes
        starts = [
            problem.start(Hypothesis(causes=tuple(kept)), values)
            for kept in combinations(causes, len(causes) - 1)
        ]
        name = f"without one of {' and '.join(best.labels)}"
        pool.add(pool.cache(name, lambda starts=starts: fit(problem, starts)))
        pool.refine(len(causes) - 1)
        if pool.ranked()[0][0].labels == best.labels:
            return
