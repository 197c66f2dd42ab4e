"""Discrepancy reduction: the gap on held-out runs, nominal, recalibrated, with each cause, black box.

Every model is treated alike: tolerances as the fitted runs determine them, each run with its own
offsets, the same bootstrap draws. A run offset may follow what a model lacks. So the interval of a share
also holds the share with nominal run offsets.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.block_bootstrap import Interval, block_starts
from identification.gap.fit.evidence import Prediction, percentage_errors, predict
from identification.gap.fit.fitting_problem import Estimate, FittingProblem
from identification.gap.fit.gaps import FLOOR, Gap, GapDraws, block_samples
from identification.gap.judge.black_box import predict_residuals
from identification.gap.plant import GreyBox
from identification.gap.prepare.prepared_plant import time_scale

NOMINAL, RECALIBRATED = "nominal", "recalibrated"
"""Labels of the two models without a cause."""

BOXED, NOMINAL_OFFSETS = " + black box", ", nominal run offsets"
"""Ends of the labels of a model with the black box on top, and with nominal run offsets."""

PERMUTATIONS, SIGNIFICANCE = 1999, 0.01
"""Random orders of blocks behind a p-value, which is then at least 0.0005, and the p-value below which a
prediction is not chance."""

LEAST_GAP_CLOSED = 0.02
"""Gap that a prediction must close to matter [noise deviations]."""


@dataclass(frozen=True, kw_only=True)
class Unexplained:
    """What a model leaves."""

    fraction: float
    """Share of the explainable gap [1]; 0 where the recalibrated model may be at the floor."""
    p_value: float
    """Of that prediction, against blocks of the residual in random order."""
    still_predictable: bool
    """True where the prediction is significant and closes a gap that matters."""


@dataclass(frozen=True, kw_only=True)
class DiscrepancyReduction:
    """The gap of each model on the held-out runs, and the share that each cause closes."""

    gaps: Mapping[str, Gap]
    """By label: 'nominal', 'recalibrated', the causes."""
    shares_closed: Mapping[str, Interval]
    """By cause: share of the explainable gap, recalibrated less floor, in 0 to 1."""
    black_box: Gap
    """The recalibrated model with the black box on top; without it where it does not help."""
    black_box_helps: bool
    """False where the recalibrated model comes nearer to the held-out runs without the black box."""
    unexplained: Unexplained
    """By the best cause; by the recalibrated model where there is none."""
    recalibration_leaves: Unexplained
    """By the recalibrated model."""
    noise_ratios: Mapping[str, float]
    """By channel: noise deviation of the gaps relative to `Channel.noise` [1]."""

    @property
    def closed_by_first(self) -> Interval:
        """Share that the best cause closes [1]; nothing where there is none."""
        return next(iter(self.shares_closed.values()), Interval(value=0.0, low=0.0, high=0.0))

    @property
    def left(self) -> Gap:
        """Gap of the best cause, of the recalibrated model where there is none."""
        return self.gaps[next(iter(self.shares_closed), RECALIBRATED)]


def measure_discrepancy_reduction(
    problem: FittingProblem,
    estimates: Mapping[str, Estimate],
    seed: int = 0,
) -> DiscrepancyReduction:
    """Judge fitted models on the held-out runs.

    Args:
        problem: the plant with its readings.
        estimates: 'nominal', 'recalibrated' and the causes by label, the best cause first.
        seed: of the bootstrap, the random features and the permutations.

    Raises:
        ValueError: where no run is held out.
    """
    plant = problem.plant
    if not any(run.held_out for run in plant.runs):
        raise ValueError("no run is held out: the share closed is judged on runs never fitted to")
    predictions = {label: predict(problem, estimate) for label, estimate in estimates.items()}
    causes = [label for label in estimates if label not in (NOMINAL, RECALIBRATED)]
    best = (*causes, RECALIBRATED)[0]
    scale = time_scale(plant)
    boxes = {}
    for label in {RECALIBRATED, best}:
        box, before, after = _foreseen(plant, predictions[label], seed)
        # A box that makes the held-out residuals larger predicts nothing.
        boxes[label] = box if after.sum() < before.sum() else [np.zeros_like(block) for block in box]
    residuals = {label: model.residuals for label, model in predictions.items()}
    for label, box in boxes.items():
        residuals[label + BOXED] = [y - p for y, p in zip(residuals[label], box, strict=True)]
    for label, model in predictions.items():
        residuals[label + NOMINAL_OFFSETS] = model.residuals_nominal_offsets
    draws = GapDraws(plant, residuals, seed, scale)
    unexplained = {
        label: _unexplained(draws, label, p_value(plant, residuals[label], box, seed, scale))
        for label, box in boxes.items()
    }
    ratios = zip(plant.channels, draws.noise, strict=True)
    return DiscrepancyReduction(
        gaps={
            label: draws.gap(label, percentage_errors(plant, predictions[label].outputs))
            for label in estimates
        },
        shares_closed={
            label: draws.share_closed(
                RECALIBRATED, label, (RECALIBRATED + NOMINAL_OFFSETS, label + NOMINAL_OFFSETS)
            )
            for label in causes
        },
        black_box=draws.gap(RECALIBRATED + BOXED),
        black_box_helps=any(np.any(block) for block in boxes[RECALIBRATED]),
        unexplained=unexplained[best],
        recalibration_leaves=unexplained[RECALIBRATED],
        noise_ratios={channel.name: float(ratio) for channel, ratio in ratios},
    )


def predictable_shares(problem: FittingProblem, estimate: Estimate) -> list[float]:
    """Share of a model's held-out squares that a black box foresees, by channel [1]."""
    _, before, after = _foreseen(problem.plant, predict(problem, estimate), seed=0)
    return list(1.0 - after / np.maximum(before, np.finfo(float).tiny))


def is_predictable(problem: FittingProblem, estimate: Estimate, seed: int = 0) -> bool:
    """Whether a black box foresees, beyond chance, what a model leaves of held-out runs."""
    plant, model = problem.plant, predict(problem, estimate)
    box, before, after = _foreseen(plant, model, seed)
    chance = p_value(plant, model.residuals, box, seed, time_scale(plant))
    return bool(after.sum() < before.sum() and chance < SIGNIFICANCE)


def _foreseen(plant: GreyBox, model: Prediction, seed: int) -> tuple[list[NDArray], NDArray, NDArray]:
    """What a black box foresees of a model's residuals, and `_held_out_squares` without and with it."""
    box = predict_residuals(plant, model, seed, time_scale(plant))
    return box, *_held_out_squares(plant, model.residuals, box)


def _held_out_squares(
    plant: GreyBox, residuals: Sequence[NDArray], predicted: Sequence[NDArray]
) -> tuple[NDArray, NDArray]:
    """Sums of squares on held-out runs, without and with a prediction subtracted, (channels,) each [1].

    residuals, predicted: per run (channels, samples) [noise deviations].
    """
    held_out = [r for r, run in enumerate(plant.runs) if run.held_out]
    before = np.sum([np.sum(residuals[r] ** 2, axis=1) for r in held_out], axis=0)
    after = np.sum([np.sum((residuals[r] - predicted[r]) ** 2, axis=1) for r in held_out], axis=0)
    return before, after


def _unexplained(draws: GapDraws, best: str, significance: float) -> Unexplained:
    """What a model leaves above the floor, and what the black box finds in it.

    significance: p-value of the black box's prediction.
    """
    recalibrated = draws.gap(RECALIBRATED).overall
    left, boxed = draws.overall(best)[0], draws.overall(best + BOXED)[0]
    explainable = max(recalibrated.value - FLOOR, 0.0)
    matters = max(LEAST_GAP_CLOSED, 0.05 * explainable)
    return Unexplained(
        fraction=float(np.clip((left - FLOOR) / explainable, 0.0, 1.0))
        if min(recalibrated.low, recalibrated.value) > FLOOR
        else 0.0,
        p_value=significance,
        still_predictable=bool(significance < SIGNIFICANCE and left - boxed > matters),
    )


def p_value(
    plant: GreyBox, residuals: Sequence[NDArray], predicted: Sequence[NDArray], seed: int, scale: float
) -> float:
    """Probability that blocks of the residual in random order agree as well with the prediction.

    Whole blocks move, within their run and all channels together. So correlations in time and between
    channels stay.

    Args:
        plant: the plant with its recordings; its held-out runs count.
        residuals: per run (channels, samples) [noise deviations].
        predicted: per run (channels, samples) [noise deviations].
        seed: of the permutations.
        scale: the plant's time scale [s].

    Returns:
        1 where nothing is predicted.
    """
    rng = np.random.default_rng(seed)
    agreement = np.zeros(PERMUTATIONS + 1)
    for run, residual, prediction in zip(plant.runs, residuals, predicted, strict=True):
        if not run.held_out:
            continue
        blocks = [_blocks(series, block_samples(run, scale)) for series in (prediction, residual)]
        products = blocks[0] @ blocks[1].T
        order = np.arange(len(products))
        agreement[0] += np.trace(products)
        agreement[1:] += [products[order, rng.permutation(order)].sum() for _ in range(PERMUTATIONS)]
    if not any(np.any(prediction) for prediction in predicted):
        return 1.0
    return float(np.mean(agreement >= agreement[0]))


def _blocks(series: NDArray, length: int) -> NDArray:
    """Series (channels, samples) as (blocks, channels x length), all as long as the shortest block."""
    starts = block_starts(series.shape[1], length)
    length = starts[1] if len(starts) > 1 else series.shape[1]
    return np.stack([series[:, start : start + length].ravel() for start in starts])
