"""Features of the black box: histories of inputs and outputs, and random Fourier features of these."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from identification.gap.model.grey_box import GreyBox
from identification.gap.reduce.settings import ReductionSettings


def history_features(
    plant: GreyBox, run: int, outputs: NDArray, scale: float, settings: ReductionSettings
) -> NDArray:
    """Inputs and model outputs at every instant, and their changes over each lag.

    Args:
        plant: the plant with its recordings.
        run: index of the run.
        outputs: model outputs, (channels, samples) [SI].
        scale: the plant's time scale [s].
        settings: the lags.

    Returns:
        (samples, signals x (1 + lags)) [SI], signals being inputs and channels.
    """
    series = np.vstack([*plant.runs[run].inputs.values(), np.nan_to_num(outputs)])
    stride = history_stride(plant, run, scale, settings)
    past = [np.roll(series, lag * stride, axis=1) for lag in settings.history_lags]
    for lag, rolled in zip(settings.history_lags, past, strict=True):
        rolled[:, : lag * stride] = series[:, :1]
    return np.vstack([series, *(series - rolled for rolled in past)]).T


def history_stride(plant: GreyBox, run: int, scale: float, settings: ReductionSettings) -> int:
    """Number of samples in the history unit, at least one; scale: the plant's time scale [s]."""
    return max(1, round(settings.history_unit * scale / plant.runs[run].time[1]))


def random_fourier_features(
    features: NDArray, seed: int, settings: ReductionSettings
) -> Callable[[NDArray], NDArray]:
    """Map to standardised features and random waves of these (Rahimi and Recht 2007).

    The lengths of the waves are log-uniform, since the residual's scale is not known. (A sampler of one
    Gaussian kernel, such as scikit-learn's RBFSampler, has a single length.)

    Args:
        features: samples from which location and scale are taken, (samples, features).
        seed: of the waves.
        settings: number and lengths of the waves.

    Returns:
        A function from (samples, features) to (samples, features + waves) [1].
    """
    mean, sd = np.mean(features, axis=0), np.std(features, axis=0)
    scale = np.where(sd > 0, 1.0 / np.where(sd > 0, sd, 1.0), 0.0)
    rng = np.random.default_rng(seed)
    count, waves, limit = features.shape[1], settings.random_features, settings.feature_limit
    low, high = np.log((settings.shortest_wave, settings.longest_wave))
    lengths = np.exp(rng.uniform(low, high, waves)) * np.sqrt(2 * count)
    frequencies = rng.standard_normal((count, waves)) / lengths
    phases = rng.uniform(0, 2 * np.pi, waves)

    def mapped(values: NDArray) -> NDArray:
        standard = np.clip((values - mean) * scale, -limit, limit)
        return np.column_stack([standard, np.sqrt(2) * np.cos(standard @ frequencies + phases)])

    return mapped
