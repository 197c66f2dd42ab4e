"""The channels' noise as the recalibrated model's residuals show it, where it was stated wrongly.

A judgement must not hinge on the noise that somebody states: fits would end too early or too late, and
channels would have wrong weights.
"""

from collections.abc import Sequence

import numpy as np

from identification.gap.fit.fitting_problem import FittingProblem
from identification.gap.fit.hypothesis import Estimate
from identification.gap.fit.prediction import predict
from identification.gap.model.prepared_plant import PreparedPlant, prepared
from identification.gap.rank.discrepancy import ChannelDiscrepancy
from identification.gap.rank.settings import RankingSettings
from identification.gap.reduce.noise_floor import LAGS, noise_ratios, squared_differences
from identification.gap.reduce.settings import ReductionSettings


def with_seen_noise(
    problem: FittingProblem, base: Estimate, settings: RankingSettings, floor: ReductionSettings
) -> PreparedPlant:
    """The plant with the noise that the residuals show; the same object where that is near the stated.

    Args:
        problem: readings weighted by the stated noise.
        base: the recalibrated model.
        settings: which ratio is near.
        floor: how noise is seen in residuals.
    """
    plant = prepared(problem.plant)
    residuals = predict(problem, base).residuals
    squares = np.sum([np.sum(r**2, axis=1) for r in residuals], axis=0)
    counts = np.sum([np.sum(run.trusted, axis=1) for run in plant.runs], axis=0)
    variograms = []
    for lag in LAGS:
        changes, kept = squared_differences(plant, residuals, lag, floor)
        total = np.sum([np.sum(change, axis=1) for change in changes], axis=0)
        number = np.sum([np.sum(keep, axis=1) for keep in kept], axis=0)
        variograms.append(0.5 * total / np.maximum(number, 1))
    ratios = noise_ratios(np.array(variograms)[:, None], (squares / np.maximum(counts, 1))[None], floor)[
        0
    ]
    limit = settings.wrong_noise_ratio
    wrong = (ratios > limit) | (ratios < 1.0 / limit)
    if not np.any(wrong):
        return plant
    return plant.with_noise(np.where(wrong, ratios, 1.0).tolist())


def with_disturbance(
    plant: PreparedPlant, discrepancies: Sequence[ChannelDiscrepancy], settings: RankingSettings
) -> PreparedPlant:
    """The plant whose disturbed channels weigh as much as they tell; the same object where none is.

    Readings under a slow disturbance do not err independently: n of them tell as much as n/inflation.
    Weighted as white noise, such a channel would pull the parameters after its disturbance.

    Args:
        plant: with the noise that the readings show.
        discrepancies: of each channel, under the best hypothesis.
        settings: which ratio of noises matters.
    """
    ratios = [np.sqrt(d.floor * d.inflation) if d.inflation > 1.0 else 1.0 for d in discrepancies]
    if max(ratios) <= settings.wrong_noise_ratio:
        return plant
    return plant.with_noise([max(float(ratio), 1.0) for ratio in ratios])
