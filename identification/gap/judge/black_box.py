"""The black-box ceiling: what of a residual can be predicted from inputs and model outputs at all.

Ridge regression on random Fourier features of present and recent inputs and model outputs; no feature
contains a reading that is to be predicted. The black box learns from the fitted runs and is judged on
the others. Leaving out each of the learning runs in turn chooses the penalty of each channel.

All penalties share one eigendecomposition of the Gram matrix per fold; scikit-learn's Ridge or RidgeCV
with grouped folds would solve each of them anew and choose one penalty for all channels.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.evidence import Prediction
from identification.gap.plant import GreyBox

HISTORY_LAGS = (1, 2, 4, 10, 20, 40, 100, 400)
"""Lags at which the black box sees inputs and outputs [history units]: 0.1 to 4 time scales for
transients, to 40 for what they leave."""

PENALTIES = np.logspace(-3.0, 5.0, 9)
"""Ridge penalties [1]: from none to no prediction, one per decade."""


def predict_residuals(plant: GreyBox, model: Prediction, seed: int, scale: float) -> list[NDArray]:
    """A model's residuals of the held-out runs as the black box predicts them.

    Args:
        plant: the plant with its recordings.
        model: outputs and residuals of the model.
        seed: of its random features.
        scale: the plant's time scale [s].

    Returns:
        Per run (channels, samples) [noise deviations]; zero in the fitted runs, which are not judged.
    """
    features = [history_features(plant, r, y, scale) for r, y in enumerate(model.outputs)]
    fitted = [r for r, run in enumerate(plant.runs) if not run.held_out]
    # One sample tells little through its noise: a stride must leave 2000 of all runs.
    longest = max(1, sum(len(features[r]) for r in fitted) // 2000)
    strides = {r: min(longest, history_stride(plant, r, scale)) for r in fitted}
    learning = [
        (features[r][::stride], model.residuals[r][:, ::stride].T) for r, stride in strides.items()
    ]
    held_out = [features[r] for r, run in enumerate(plant.runs) if run.held_out]
    predictions = iter(ridge_on_random_features(learning, held_out, seed))
    return [
        next(predictions) * run.trusted if run.held_out else np.zeros(run.measured.shape)
        for run in plant.runs
    ]


def ridge_on_random_features(
    learning: Sequence[tuple[NDArray, NDArray]], features: Sequence[NDArray], seed: int
) -> list[NDArray]:
    """Ridge regression with the penalty that predicts left-out runs best.

    Args:
        learning: of each run to learn from, features (samples, features) [SI], and the residual
            (samples, channels) [noise deviations], 0 at untrusted readings. A single run is cut in two.
        features: of the runs to predict, (samples, features) each [SI].
        seed: of the random features.

    Returns:
        Per run (channels, samples) [noise deviations]; zero where leaving runs out shows nothing that
        carries over.
    """
    waves = random_fourier_features(np.concatenate([values for values, _ in learning]), seed)
    if len(learning) == 1:
        ((values, target),) = learning
        middle = len(values) // 2
        learning = [(values[:middle], target[:middle]), (values[middle:], target[middle:])]
    folds = [(waves(values), target) for values, target in learning]
    linear = learning[0][0].shape[1]
    grams = np.array([z.T @ z for z, _ in folds])
    moments = np.array([z.T @ y for z, y in folds])
    left = 0.0
    for (z, y), gram, moment in zip(folds, grams, moments, strict=True):
        others = _solutions(grams.sum(axis=0) - gram, moments.sum(axis=0) - moment, linear)
        left = left + np.sum((y[:, None] - np.tensordot(z, others, (1, 0))) ** 2, axis=0)
    solutions = _solutions(grams.sum(axis=0), moments.sum(axis=0), linear)
    best = np.argmin(left, axis=0)
    weights = np.take_along_axis(solutions, best[None, None], axis=1)[:, 0]
    return [(waves(values) @ weights).T for values in features]


def _solutions(gram: NDArray, moment: NDArray, linear: int) -> NDArray:
    """Weights by choice of the model, (features, 1 + 2 penalties, channels).

    The choices are: no prediction; by penalty, the linear features alone; by penalty, all features.

    gram, moment: products of the features, and with the targets. linear: features that come first.
    """
    weights = np.zeros((len(gram), 1 + 2 * len(PENALTIES), moment.shape[1]))
    for first, size in ((1, linear), (1 + len(PENALTIES), len(gram))):
        values, vectors = np.linalg.eigh(gram[:size, :size])
        turned = vectors.T @ moment[:size]
        for p, penalty in enumerate(PENALTIES):
            damped = turned / (np.maximum(values, 0)[:, None] + penalty)
            weights[:size, first + p] = vectors @ damped
    return weights


def history_features(plant: GreyBox, run: int, outputs: NDArray, scale: float) -> NDArray:
    """Inputs and model outputs at every instant, and their changes over each lag.

    Args:
        plant: the plant with its recordings.
        run: index of the run.
        outputs: model outputs, (channels, samples) [SI].
        scale: the plant's time scale [s].

    Returns:
        (samples, signals x (1 + lags)) [SI], signals being inputs and channels.
    """
    series = np.vstack([*plant.runs[run].inputs.values(), np.nan_to_num(outputs)])
    stride = history_stride(plant, run, scale)
    past = [np.roll(series, lag * stride, axis=1) for lag in HISTORY_LAGS]
    for lag, rolled in zip(HISTORY_LAGS, past, strict=True):
        rolled[:, : lag * stride] = series[:, :1]
    return np.vstack([series, *(series - rolled for rolled in past)]).T


def history_stride(plant: GreyBox, run: int, scale: float) -> int:
    """Number of samples in the history unit, at least one; scale: the plant's time scale [s].

    The unit is a tenth of the time scale: a transient has about ten.
    """
    return max(1, round(0.1 * scale / plant.runs[run].time[1]))


def random_fourier_features(features: NDArray, seed: int) -> Callable[[NDArray], NDArray]:
    """Map to standardised features and random waves of these (Rahimi and Recht 2007).

    The lengths of the waves are log-uniform, since the residual's scale is not known. (A sampler of one
    Gaussian kernel, such as scikit-learn's RBFSampler, has a single length.)

    Args:
        features: samples from which location and scale are taken, (samples, features).
        seed: of the waves.

    Returns:
        A function from (samples, features) to (samples, features + waves) [1].
    """
    mean, sd = np.mean(features, axis=0), np.std(features, axis=0)
    scale = np.where(sd > 0, 1.0 / np.where(sd > 0, sd, 1.0), 0.0)
    rng = np.random.default_rng(seed)
    count, waves = features.shape[1], 300
    low, high = np.log((0.2, 3.0))  # in typical distances of two samples
    lengths = np.exp(rng.uniform(low, high, waves)) * np.sqrt(2 * count)
    frequencies = rng.standard_normal((count, waves)) / lengths
    phases = rng.uniform(0, 2 * np.pi, waves)

    def mapped(values: NDArray) -> NDArray:
        standard = np.clip((values - mean) * scale, -10.0, 10.0)  # for samples unlike all others
        return np.column_stack([standard, np.sqrt(2) * np.cos(standard @ frequencies + phases)])

    return mapped
