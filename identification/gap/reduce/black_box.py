"""The black-box ceiling: what can be predicted of a residual from inputs and model outputs at all.

Ridge regression on random Fourier features (Rahimi & Recht 2007) of the present and recent inputs and
model outputs, which never contain a reading that is to be predicted. It learns from some runs and is
judged on others; how much it dares is chosen by leaving out each of its own runs in turn.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.prediction import Prediction
from identification.gap.model.grey_box import GreyBox

BASE = 5e-4
"""Time in whose multiples the history is looked at, or the sampling period if that is longer [s]."""

LAGS = (1, 2, 4, 10, 20, 40, 100, 400)
"""Of the history, in multiples of BASE: 0.5 to 20 ms for transients, to 200 ms for what they leave."""

FEATURES = 300
"""Random waves; their lengths, in the typical distance of two instants, lie between the following."""
LENGTHS = (0.2, 3.0)

PENALTIES = np.logspace(-3, 5, 9)
"""Of the ridge, on features of unit mean square; the cap on what is learnt."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """A run to learn from."""

    features: NDArray
    """(samples, features)."""
    target: NDArray
    """(channels, samples): the residual, 0 where there is no reading that counts."""


Learner = Callable[[Sequence[Task], Sequence[NDArray], int], list[NDArray]]
"""(runs to learn from, features of runs to predict, seed): predictions (channels, samples)."""


def learnt(plant: GreyBox, model: Prediction, learner: Learner, seed: int) -> list[NDArray]:
    """A model's residuals of the held-out runs as the fitted runs' let expect, (channels, samples).

    Zero in the fitted runs, which are not judged.
    """
    tasks = [
        Task(features=history(plant, r, model.outputs[r]), target=residual)
        for r, residual in enumerate(model.residuals)
    ]
    held_out = [r for r, run in enumerate(plant.runs) if run.held_out]
    fitted = [_thinned(tasks[r], _stride(plant, r)) for r in range(len(tasks)) if r not in held_out]
    answers = iter(learner(fitted, [tasks[r].features for r in held_out], seed))
    return [
        next(answers) * run.trusted if run.held_out else np.zeros(run.measured.shape)
        for run in plant.runs
    ]


def history(plant: GreyBox, run: int, outputs: NDArray) -> NDArray:
    """Inputs and model outputs (channels, samples) at every instant, and their recent changes."""
    series = np.vstack([*plant.runs[run].inputs.values(), np.nan_to_num(outputs)])
    stride = _stride(plant, run)
    past = [np.roll(series, lag * stride, axis=1) for lag in LAGS]
    for lag, rolled in zip(LAGS, past, strict=True):
        rolled[:, : lag * stride] = series[:, :1]
    return np.vstack([series, *(series - rolled for rolled in past)]).T


def _stride(plant: GreyBox, run: int) -> int:
    """Samples in BASE."""
    return max(1, round(BASE / plant.runs[run].time[1]))


def _thinned(task: Task, stride: int) -> Task:
    """Every so many samples: denser ones tell nothing more."""
    return Task(features=task.features[::stride], target=task.target[:, ::stride])


def ridge(known: Sequence[Task], features: Sequence[NDArray], seed: int) -> list[NDArray]:
    """The standard `Learner`. Zero where leaving runs out shows nothing that carries over."""
    waves = _waves(np.concatenate([task.features for task in known]), seed)
    folds = [(waves(task.features), task.target.T) for task in _halved(known)]
    grams = np.array([z.T @ z for z, _ in folds])
    moments = np.array([z.T @ y for z, y in folds])
    linear = known[0].features.shape[1]
    left = 0.0
    for (z, y), gram, moment in zip(folds, grams, moments, strict=True):
        others = _solutions(grams.sum(axis=0) - gram, moments.sum(axis=0) - moment, linear)
        left = left + np.sum((y[:, None] - np.tensordot(z, others, (1, 0))) ** 2, axis=0)
    solutions = _solutions(grams.sum(axis=0), moments.sum(axis=0), linear)
    best = np.argmin(left, axis=0)
    weights = np.take_along_axis(solutions, best[None, None], axis=1)[:, 0]
    return [(waves(values) @ weights).T for values in features]


def _halved(tasks: Sequence[Task]) -> list[Task]:
    """Runs to leave out in turn; a single one is cut in two."""
    if len(tasks) > 1:
        return list(tasks)
    task, middle = tasks[0], len(tasks[0].features) // 2
    return [
        Task(features=task.features[part], target=task.target[:, part])
        for part in (slice(None, middle), slice(middle, None))
    ]


def _solutions(gram: NDArray, moment: NDArray, linear: int) -> NDArray:
    """Weights (features, choices, channels): none; by penalty, of linear features alone and of all."""
    found = np.zeros((len(gram), 1 + 2 * len(PENALTIES), moment.shape[1]))
    for first, size in ((1, linear), (1 + len(PENALTIES), len(gram))):
        values, vectors = np.linalg.eigh(gram[:size, :size])
        turned = vectors.T @ moment[:size]
        for p, penalty in enumerate(PENALTIES):
            found[:size, first + p] = vectors @ (turned / (np.maximum(values, 0)[:, None] + penalty))
    return found


def _waves(features: NDArray, seed: int) -> Callable[[NDArray], NDArray]:
    """Map to standardised features and random waves of them (samples, ...)."""
    mean, sd = np.mean(features, axis=0), np.std(features, axis=0)
    scale = np.where(sd > 0, 1.0 / np.where(sd > 0, sd, 1.0), 0.0)
    rng = np.random.default_rng(seed)
    count = features.shape[1]
    low, high = np.log(LENGTHS)
    lengths = np.exp(rng.uniform(low, high, FEATURES)) * np.sqrt(2 * count)
    frequencies = rng.standard_normal((count, FEATURES)) / lengths
    phases = rng.uniform(0, 2 * np.pi, FEATURES)

    def mapped(values: NDArray) -> NDArray:
        standard = np.clip((values - mean) * scale, -10, 10)
        return np.column_stack([standard, np.sqrt(2) * np.cos(standard @ frequencies + phases)])

    return mapped
