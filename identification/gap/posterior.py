"""Probabilities of hypotheses: a conditional logit of a few figures, with weights learnt on trials.

A hypothesis is a set of causes, no cause, or an unknown one. Its log probability is, but for a constant,
a weighted sum of figures that mean the same for every plant (McFadden 1974), less the logarithm of the
number of sets with as many causes, of which each is as probable before the data. The share of the misfit
that it leaves stands in for the likelihood: where the variance of the model's discrepancy is unknown,
the likelihood is a power of the misfit. The weights were fitted on opened trials of several virtual
plants (docs/studies/calibration), so the probabilities are as often right there as they say.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, softmax

from identification.gap.discrepancy import ChannelDiscrepancy, channel_discrepancies
from identification.gap.evidence import EvaluatedHypothesis
from identification.gap.fitting_problem import FittingProblem

FIGURES = ("fit", "causes", "strain", "no_cause", "seen", "unknown")
"""Names of the figures, in the order of their weights."""

CHANCE_MISFIT = 15.0
"""Misfit that chance leaves [nats]: less is no misfit."""

FORM_SHARE, UNKNOWN_SHARE = 3e-4, 0.05
"""Share of the recalibrated model's misfit that counts as none [1], 2 % in amplitude, and the share that
an unknown cause is taken to leave: less is rarely left by chance."""


def _weights() -> NDArray:
    text = resources.files("identification.gap").joinpath("weights.json").read_text(encoding="utf-8")
    values = json.loads(text)["weights"]
    return np.array([values[name] for name in FIGURES])


WEIGHTS = _weights()
"""Weight of each figure, (figures,)."""


@dataclass(frozen=True, kw_only=True)
class Posterior:
    """Probabilities of n hypotheses with causes, and of the others."""

    hypotheses: list[EvaluatedHypothesis]
    """Single causes and sets of causes, (n,)."""
    probabilities: list[float]
    """Of each hypothesis, (n,); with the two following they sum to 1."""
    no_cause: float
    """Probability that no cause acts."""
    unknown: float
    """Probability that what acts has no name in the catalogue."""
    figures: NDArray
    """Of each hypothesis, then of no cause and of an unknown one, (n + 2, figures)."""
    scores: list[float]
    """Log probability of each but for a constant, (n,) [nats]."""
    shares_left: list[float]
    """Share of the misfit beyond noise that each hypothesis leaves, (n,) [1]."""
    discrepancies: list[ChannelDiscrepancy]
    """Noise and discrepancy of each channel under the best hypothesis."""


def posterior(
    problem: FittingProblem, recalibrated: EvaluatedHypothesis, hypotheses: Sequence[EvaluatedHypothesis]
) -> Posterior:
    """Probabilities of hypotheses with causes, of no cause and of an unknown one."""
    every = [recalibrated, *hypotheses]
    best = min(every, key=lambda each: float(np.sum(np.log(np.maximum(each.squares, 1e-300)))))
    discrepancies = channel_discrepancies(problem.plant, best.residuals)
    misfits = np.array([misfit_beyond_noise(each, discrepancies) for each in every])
    misfits = misfits - min(float(np.min(misfits)), 0.0)
    figures = hypothesis_figures(every, misfits)
    scores = figures @ WEIGHTS - log_sets(problem, hypotheses)
    scores[:-2][[each.at_bound for each in hypotheses]] = -np.inf
    weights = softmax(scores)
    return Posterior(
        hypotheses=list(hypotheses),
        probabilities=weights[:-2].tolist(),
        no_cause=float(weights[-2]),
        unknown=float(weights[-1]),
        figures=figures,
        scores=scores[:-2].tolist(),
        shares_left=(misfits[1:] / (misfits[0] + CHANCE_MISFIT)).tolist(),
        discrepancies=discrepancies,
    )


def hypothesis_figures(every: Sequence[EvaluatedHypothesis], misfits: NDArray) -> NDArray:
    """Figures of hypotheses, then of no cause and of an unknown one, (n + 2, figures).

    fit: minus the log of the share of the misfit that is left. causes: their number. strain: log of
    1 + half the squared deviations of all nuisances, modes of form included. seen: log of the misfit
    over that of chance, of no cause.

    every: no cause first. misfits: of each beyond noise, (n + 1,) [nats].
    """
    whole = misfits[0] + CHANCE_MISFIT
    least = CHANCE_MISFIT + FORM_SHARE * misfits[0]
    rows = [
        (
            -np.log((misfit + least) / whole),
            len(each.labels),
            np.log1p(each.nuisance_penalty),
            float(not each.labels),
            0.0 if each.labels else np.log(whole / CHANCE_MISFIT),
            0.0,
        )
        for each, misfit in zip(every, misfits, strict=True)
    ]
    unknown_fit = -np.log((CHANCE_MISFIT + UNKNOWN_SHARE * misfits[0]) / whole)
    unknown = (unknown_fit, 0.0, 0.0, 0.0, 0.0, 1.0)
    return np.array([*rows[1:], rows[0], unknown])


def log_sets(problem: FittingProblem, every: Sequence[EvaluatedHypothesis]) -> NDArray:
    """Log of the number of sets with as many causes as each, as none and as an unknown one, (n + 2,).

    every: with causes.
    """
    causes = len({cause.name for cause in problem.plant.causes})
    chosen = np.array([*(len(each.labels) for each in every), 0, 0])
    return gammaln(causes + 1) - gammaln(chosen + 1) - gammaln(causes - chosen + 1)


def misfit_beyond_noise(each: EvaluatedHypothesis, discrepancies: Sequence[ChannelDiscrepancy]) -> float:
    """Half the sum of squares beyond the floors, in their variances, and of nuisances [nats]."""
    return each.nuisance_penalty + sum(
        (float(squares) / d.floor - d.readings) / (2.0 * d.inflation)
        for squares, d in zip(each.squares, discrepancies, strict=True)
    )


def misfit_beyond_white_noise(
    each: EvaluatedHypothesis, discrepancies: Sequence[ChannelDiscrepancy]
) -> float:
    """The same beyond white noise alone: a misfit that is always there may look like a disturbance."""
    return each.nuisance_penalty + sum(
        (float(squares) / max(d.mean_square - d.sd**2, d.floor * 1e-3) - d.readings) / 2.0
        for squares, d in zip(each.squares, discrepancies, strict=True)
    )


def variance_inflation(each: EvaluatedHypothesis, discrepancies: Sequence[ChannelDiscrepancy]) -> float:
    """Variance of a parameter relative to that under white noise of the channels' size [1], at least 1.

    Noise and discrepancy together count, and readings that are correlated tell less.
    """
    correlations = np.array([d.autocorrelation for d in discrepancies])
    readings = sum(d.readings for d in discrepancies)
    return max(float(np.sum(correlations * each.squares)) / max(readings, 1), 1.0)
