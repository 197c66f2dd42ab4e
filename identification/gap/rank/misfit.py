"""Misfits beyond sensor noise: errors of a cause's form, and generic misfits without a cause.

A series is cut into short segments. In each segment the misfit is a Gaussian random factor on the effect
of every cause (error of form), or a Gaussian random offset (generic misfit). Both are integrated out in
closed form.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.hypothesis import Estimate, cause_places, nominal_vector
from identification.gap.fit.variable_projection import LinearisedRun
from identification.gap.model.grey_box import GreyBox
from identification.gap.rank.settings import RankingSettings


def segments(series: NDArray, period: float, duration: float) -> NDArray:
    """A series (samples,) of any unit in segments (segments, samples of one), the last one zero-padded.

    period: of sampling [s]. duration: of a segment [s].
    """
    length = max(1, round(duration / period))
    count = -(-len(series) // length)
    padded = np.zeros(count * length)
    padded[: len(series)] = series
    return padded.reshape(count, length)


def segment_columns(columns: NDArray, period: float, duration: float) -> NDArray:
    """Columns (samples, n) of any unit in segments, (segments, samples of one, n).

    period: of sampling [s]. duration: of a segment [s].
    """
    return np.stack([segments(column, period, duration) for column in columns.T], axis=2)


def cause_effects(estimate: Estimate, run: LinearisedRun) -> NDArray:
    """Change of the outputs by each cause of uncertain form, (values, causes) [noise deviations].

    The change is linear in the parameters of the cause: from their nominal values to the estimate.
    """
    effects = []
    for cause, place, run_place in cause_places(estimate):
        acting = estimate.vector[place] - nominal_vector(cause)
        own = run.run_slopes[:, run_place] @ run.run_values[run_place]
        if not cause.exact_form:
            effects.append(run.slopes[:, place] @ acting + own)
    return np.stack(effects, axis=1) if effects else np.zeros((len(run.residual), 0))


def form_error_misfits(
    plant: GreyBox, run: int, residual: NDArray, effects: NDArray, settings: RankingSettings
) -> NDArray:
    """-2 log likelihood of one run but for a constant, for each size of form errors, (form errors,).

    Every cause errs independently of the others.

    Args:
        plant: the plant with its recordings.
        run: index of the run.
        residual: (channels x samples,) [noise deviations].
        effects: effects of causes of uncertain form, (channels x samples, causes) [noise deviations].
        settings: form errors and segments.
    """
    recorded = plant.runs[run]
    shape, period = recorded.measured.shape, recorded.time[1]
    total = np.full(len(settings.form_errors), float(residual @ residual))
    if not effects.shape[1]:
        return total
    by_channel = zip(residual.reshape(shape), effects.reshape(*shape, effects.shape[1]), strict=True)
    for channel, changes in by_channel:
        parts = segments(channel, period, settings.segment_duration)
        columns = segment_columns(changes, period, settings.segment_duration)
        squares = np.einsum("bsi,bsj->bij", columns, columns)
        products = np.einsum("bsi,bs->bi", columns, parts)
        for k, error in enumerate(settings.form_errors):
            gram = np.eye(columns.shape[2]) + error**2 * squares
            allowed = error**2 * np.linalg.solve(gram, products[..., None])[..., 0]
            total[k] += np.sum(np.linalg.slogdet(gram)[1]) - np.sum(products * allowed)
    return total


def explained_by_form_errors(
    columns: NDArray, errors: NDArray, channels: int, period: float, duration: float
) -> NDArray:
    """Part of the products of columns that errors of form explain, (n, n) [1].

    Args:
        columns: predictions and derivatives, (channels x samples, n) [noise deviations].
        errors: effects of causes times the size of their form error, (channels x samples, causes).
        channels: number of channels.
        period: of sampling [s].
        duration: of a segment, in which an error is constant [s].
    """
    total = np.zeros((columns.shape[1], columns.shape[1]))
    for own_columns, own_errors in zip(
        np.split(columns, channels), np.split(errors, channels), strict=True
    ):
        parts = segment_columns(own_columns, period, duration)
        effects = segment_columns(own_errors, period, duration)
        gram = np.eye(effects.shape[2]) + effects.transpose(0, 2, 1) @ effects
        products = np.linalg.solve(np.linalg.cholesky(gram), effects.transpose(0, 2, 1) @ parts)
        flat = products.reshape(-1, products.shape[2])
        total += flat.T @ flat
    return total


def generic_misfit_log_evidence(
    plant: GreyBox, residuals: Sequence[NDArray], settings: RankingSettings
) -> float:
    """Log evidence of a generic misfit: in every segment of a channel a random offset.

    Variance and duration of the offsets are fitted for each channel (type-II likelihood), at the price
    of two fitted numbers.

    residuals: per run (channels, samples) [noise deviations].
    """
    total = 0.0
    for channel in range(len(residuals[0])):
        series = [residual[channel] for residual in residuals]
        squares = sum(float(np.sum(np.square(part))) for part in series)
        gains = [_offset_gain(plant, series, d, settings) for d in settings.misfit_durations]
        total += -0.5 * (squares - max(gains)) - np.log(len(settings.misfit_durations))
    return total


def _offset_gain(
    plant: GreyBox, series: Sequence[NDArray], duration: float, settings: RankingSettings
) -> float:
    """Decrease of -2 log likelihood by offsets of the best variance, less the price of a number."""
    parts = [segments(part, run.time[1], duration) for part, run in zip(series, plant.runs, strict=True)]
    sums = np.concatenate([np.sum(part, axis=1) for part in parts])
    counts = np.concatenate([np.sum(part != 0, axis=1) for part in parts])
    variances = np.logspace(*settings.misfit_decades, settings.misfit_variances)
    gains = [np.sum(v * sums**2 / (1 + v * counts) - np.log1p(v * counts)) for v in variances]
    return float(max(gains)) - np.log(len(sums))


def variance_inflation(plant: GreyBox, residuals: Sequence[NDArray], duration: float) -> float:
    """Variance of sums over segments relative to that of white residuals, at least 1 [1].

    residuals: per run (channels, samples) [noise deviations]. duration: of a segment [s].
    """
    parts = [
        segments(channel, run.time[1], duration)
        for residual, run in zip(residuals, plant.runs, strict=True)
        for channel in residual
    ]
    of_sums = sum(float(np.sum(np.sum(part, axis=1) ** 2)) for part in parts)
    of_samples = sum(float(np.sum(part**2)) for part in parts)
    return max(1.0, of_sums / of_samples)
