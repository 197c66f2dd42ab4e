"""Search for the causes: singles, then sets grown by one cause at a time and pruned again."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import combinations

from identification.gap.evidence import EvaluatedHypothesis, evaluate
from identification.gap.fitting_problem import Estimate, FitCache, FittingProblem, Hypothesis
from identification.gap.gauss_newton import fit, linearise
from identification.gap.plant import GreyBox
from identification.gap.posterior import NO_CAUSE_DOUBT, Posterior, misfit_beyond_noise, posterior
from identification.gap.recalibration import refit, with_own_nuisances
from identification.gap.screening import (
    CauseSignature,
    Separability,
    Start,
    best_start_of_each,
    promising_causes,
    promising_pairs,
    screen_causes,
    simulate_signatures,
    simulated_starts,
    with_cause,
)
from identification.gap.variable_projection import LinearisedRun

MOST_CAUSES = 4
"""Largest number of causes that are taken to act together."""

ALIKE_CORRELATION = 0.8
"""Correlation of signatures [1] above which a cause that resembles one of the best is refitted as well:
screening by one linear step cannot order causes that look alike."""

SMALL_MISFIT = 30.0
"""Misfit beyond noise [nats] up to which a set leaves little: another cause can hardly be seen."""

LAST_GAIN = 1.0
"""Gain in score that another cause must bring for the search to go on [nats]."""

# Numbers for the sake of computing time.

MULTI_START_CAUSES = 12
"""Largest catalogue of which every cause is refitted from each of its trial values, and every pair:
causes may help together that do not help alone. A larger one begins at the most promising values."""

REFITTED_CAUSES = 20
"""Single causes that are refitted, those with the least predicted chi-square."""

FINALISTS = (8, 4)
"""Single causes refined with nuisance slopes of their own, in the first and the second round."""

SET_FINALISTS = 3
"""Sets of causes of one size that are refined so."""

FINALIST_LAG = 12.0
"""Score by which the best fit may lead a fit that is refined [nats]."""

BASES = 2
"""The best sets of one size to which another cause is added."""

PARTNERS, PARTNERS_OF_SMALL_MISFIT = 8, 3
"""Causes tried beside a set that leaves a large misfit, and a small one."""

SIMULATED_PER_PARTNER = 2
"""Causes of a large catalogue that are simulated beside a set for each that is refitted there."""

STARTS_OF_A_PAIR = 2
"""Starts from which a pair is refitted, the most promising of all combinations of trial values."""

SCREENED_PAIRS = 2
"""Pairs of a larger catalogue that are refitted because they promise most together, though neither
member is among the best."""


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

    def add(self, estimates: Iterable[Estimate]) -> None:
        """Evaluate refitted estimates and keep the best of each set of causes."""
        for evaluated in evaluate(self.problem, list(estimates)):
            labels = frozenset(evaluated.labels)
            if self._keep(evaluated):
                self.first_fits[labels] = evaluated.estimate

    def refine(self, evaluated: Sequence[EvaluatedHypothesis], name: str) -> None:
        """Fit hypotheses further, with nuisance slopes of their own; name: of the step."""
        for refined in with_own_nuisances(self.problem, evaluated, name, self.cache):
            self._keep(refined, refined=True)

    def _keep(self, evaluated: EvaluatedHypothesis, refined: bool = False) -> bool:
        """Keep a fit that is better than the present one of its set; a refined one always."""
        labels = frozenset(evaluated.labels)
        present = self._best.get(labels)
        better = present is None or misfit(evaluated) < misfit(present)
        if better or refined:
            self._best[labels] = evaluated
        return better or refined

    def __contains__(self, labels: frozenset[str]) -> bool:
        """Whether a set of causes was refitted."""
        return labels in self._best

    def posterior(self) -> tuple[list[EvaluatedHypothesis], Posterior]:
        """All hypotheses with causes, and their probabilities in the same order."""
        hypotheses = list(self._best.values())
        return hypotheses, posterior(self.problem, self.recalibrated, hypotheses)

    def ranked(self, number: int | None = None) -> list[tuple[EvaluatedHypothesis, float]]:
        """Hypotheses with a number of causes, or all, and their scores [nats], the best first."""
        hypotheses, found = self.posterior()
        pairs = [
            (each, score)
            for each, score in zip(hypotheses, found.scores, strict=True)
            if number is None or len(each.labels) == number
        ]
        return sorted(pairs, key=lambda pair: (-pair[1], misfit(pair[0])))


def search_causes(
    pool: HypothesisPool,
    base: Estimate,
    base_runs: Sequence[LinearisedRun],
    signatures: Sequence[CauseSignature],
    separability: Separability,
) -> None:
    """Refit the promising sets of causes into the pool.

    Args:
        pool: begins without causes.
        base: the recalibrated model.
        base_runs: the same linearised in the fitted runs.
        signatures: of all causes beside it.
        separability: of these signatures.
    """
    screened = screen_causes(pool.problem, base, base_runs, signatures, every_start=pool.small)
    _fit_singles(pool, base, screened, separability)
    for number in range(2, MOST_CAUSES + 1):
        if not _another_cause_may_act(pool, number):
            break
        _add_a_cause(pool, number, signatures)
        if number == 2:
            _fit_promising_pairs(pool, base, base_runs, signatures, screened)
        _refine_best(pool, number, SET_FINALISTS, f"sets of {number}")
    _leave_causes_out(pool)


def _fit_singles(
    pool: HypothesisPool, base: Estimate, screened: Sequence[Start], separability: Separability
) -> None:
    """Single causes: the promising ones, those that look like the best, and the best refined."""
    problem = pool.problem
    most = len(screened) if pool.small else REFITTED_CAUSES
    first, others = screened[:most], screened[most:]
    pool.add(pool.cache("single causes", lambda: refit(problem, base, first)))
    best = [each.labels[0] for each, _ in pool.ranked(1)[: FINALISTS[1]]]
    resembling = {label for own in best for label in separability.alike(own, ALIKE_CORRELATION)}
    alike = [each for each in others if each.cause.label in resembling]
    if alike:
        pool.add(pool.cache("causes like the best", lambda: refit(problem, base, alike)))
    for number, most in enumerate(FINALISTS, start=1):
        _refine_best(pool, 1, most, f"single causes, round {number}")


def _refine_best(pool: HypothesisPool, number: int, most: int, name: str) -> None:
    """Refine the best sets of a number of causes."""
    ranked = pool.ranked(number)[:most]
    if ranked:
        best = ranked[0][1]
        near = [each for each, score in ranked if best - score <= FINALIST_LAG]
        pool.refine(near, f"{name}: own nuisances")


def _another_cause_may_act(pool: HypothesisPool, number: int) -> bool:
    """Whether sets of `number` causes are worth a search: the last cause helped, or much is left.

    Where four causes act, the second one alone may hardly pay; a small catalogue is searched on.
    """
    found = pool.posterior()[1]
    if found.no_cause > NO_CAUSE_DOUBT:
        return False
    if number == 2:
        return True
    larger, smaller = pool.ranked(number - 1), pool.ranked(number - 2)
    if not larger:
        return False
    left = misfit_beyond_noise(larger[0][0], found.discrepancies)
    if pool.small and left > SMALL_MISFIT:
        return True
    return larger[0][1] > smaller[0][1] + LAST_GAIN


def _add_a_cause(pool: HypothesisPool, number: int, signatures: Sequence[CauseSignature]) -> None:
    """Refit the best smaller sets with each of the causes that promise most beside them."""
    ranked = pool.ranked(number - 1)
    left = misfit_beyond_noise(ranked[0][0], pool.posterior()[1].discrepancies) if ranked else 0.0
    small = left <= SMALL_MISFIT
    partners = PARTNERS_OF_SMALL_MISFIT if small else PARTNERS
    for smaller, score in ranked[: 1 if small else BASES]:
        if ranked[0][1] - score > FINALIST_LAG and not pool.small:
            break
        pool.add(_fits_with_another(pool, smaller, signatures, partners))


def _fits_with_another(
    pool: HypothesisPool,
    smaller: EvaluatedHypothesis,
    signatures: Sequence[CauseSignature],
    partners: int,
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
            causes = causes[: SIMULATED_PER_PARTNER * partners]
        beside = simulate_signatures(problem, base, causes)
        screened = screen_causes(problem, base, base_runs, beside, every_start=pool.small)
        kept = screened if pool.small else screened[:partners]
        return refit(problem, base, kept)

    return pool.cache(f"beside {' and '.join(smaller.labels)}", fits) if others else []


def _fit_promising_pairs(
    pool: HypothesisPool,
    base: Estimate,
    base_runs: Sequence[LinearisedRun],
    signatures: Sequence[CauseSignature],
    screened: Sequence[Start],
) -> None:
    """Pairs that promise much together; all pairs of a small catalogue."""
    problem = pool.problem
    wanted: list[frozenset[str]] | None = None
    if not pool.small:
        labels = promising_pairs(base_runs, signatures)
        wanted = [own for own in labels if own not in pool][:SCREENED_PAIRS]
    together = [
        _both(problem, base, first, second)
        for first, second in combinations(screened, 2)
        if first.cause.name != second.cause.name
        and (wanted is None or frozenset((*first.labels, *second.labels)) in wanted)
    ]

    def fits() -> list[Estimate]:
        starts = simulated_starts(problem, base, base_runs, together)
        return refit(problem, base, _best_starts(starts, STARTS_OF_A_PAIR))

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
            replace(problem.start(Hypothesis(causes=tuple(kept)), values), slopes=best.estimate.slopes)
            for kept in combinations(causes, len(causes) - 1)
        ]
        name = f"without one of {' and '.join(best.labels)}"
        fitted = pool.cache(name, lambda starts=starts: fit(problem, starts))
        pool.add(
            replace(estimate, slopes=best.estimate.slopes)  # a journal keeps no slopes
            for estimate in fitted
        )
        if pool.ranked()[0][0].labels == best.labels:
            return


def misfit(evaluated: EvaluatedHypothesis) -> float:
    """Sum of squares of all channels and nuisance parameters [1]."""
    return float(evaluated.squares.sum()) + 2.0 * evaluated.nuisance_penalty
