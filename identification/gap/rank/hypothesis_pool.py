"""All hypotheses that were refitted, the best fit of each set of causes, and their scores."""

from collections.abc import Iterable, Sequence

from identification.gap.fit.fit_cache import FitCache
from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.fit.hypothesis import Estimate
from identification.gap.rank.evidence import EvaluatedHypothesis, evaluate
from identification.gap.rank.posterior import Posterior, posterior
from identification.gap.rank.refinement import with_own_nuisances
from identification.gap.rank.settings import RankingSettings


class HypothesisPool:
    """Refitted sets of causes; grows while the search goes on."""

    def __init__(
        self,
        problem: FittingProblem,
        recalibrated: EvaluatedHypothesis,
        cache: FitCache,
        settings: RankingSettings,
    ):
        """Begin without causes.

        Args:
            problem: readings and settings of the fits.
            recalibrated: the model without a cause.
            cache: runs the fits.
            settings: judgement.
        """
        self.problem = problem
        self.recalibrated = recalibrated
        self.cache = cache
        self.settings = settings
        self.first_fits: dict[frozenset[str], Estimate] = {}
        """Estimate of each set before its refinement. Refined nuisance parameters follow what the set
        lacks; from the first fit another cause is seen better."""
        self._best: dict[frozenset[str], EvaluatedHypothesis] = {}

    def add(self, estimates: Iterable[Estimate]) -> None:
        """Evaluate refitted estimates and keep the best of each set of causes."""
        for evaluated in evaluate(self.problem, list(estimates), self.settings):
            labels = frozenset(evaluated.labels)
            if self._keep(evaluated):
                self.first_fits[labels] = evaluated.estimate

    def refine(self, evaluated: Sequence[EvaluatedHypothesis], name: str) -> None:
        """Fit hypotheses further, with nuisance slopes of their own; name: of the step."""
        for refined in with_own_nuisances(self.problem, evaluated, name, self.cache, self.settings):
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
        return hypotheses, posterior(self.problem, self.recalibrated, hypotheses, self.settings)

    def ranked(self, number: int | None = None) -> list[tuple[EvaluatedHypothesis, float]]:
        """Hypotheses with a number of causes, or all, and their scores [nats], the best first."""
        hypotheses, found = self.posterior()
        pairs = [
            (each, score)
            for each, score in zip(hypotheses, found.scores, strict=True)
            if number is None or len(each.labels) == number
        ]
        return sorted(pairs, key=lambda pair: (-pair[1], misfit(pair[0])))


def misfit(evaluated: EvaluatedHypothesis) -> float:
    """Sum of squares of all channels and nuisance parameters [1]."""
    return float(evaluated.squares.sum()) + 2.0 * evaluated.nuisance_penalty
