"""The Gaussian that each rival predicts for the outcome of a planned run."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.gap.design.form_errors import explained_by_form_errors
from identification.gap.design.parameter_posterior import ParameterPosterior
from identification.gap.design.settings import DesignSettings
from identification.gap.fit.variable_projection import LinearisedRun, tolerances_as_slopes


def outcome_distributions(
    runs: Sequence[LinearisedRun],
    posteriors: Sequence[ParameterPosterior],
    effects: NDArray,
    channels: int,
    period: float,
    settings: DesignSettings,
) -> tuple[NDArray, NDArray]:
    """Each rival's Gaussian of the outcome of one run.

    The d coordinates hold all predictions and their derivatives. Noise, errors of form included, is
    white and of unit variance in them; the first rival's mean is the origin.

    Args:
        runs: each rival's prediction, as a residual, and its derivatives.
        posteriors: of each rival's parameters.
        effects: effects of all rivals' causes of uncertain form, (values, causes) [noise deviations].
        channels: number of channels.
        period: of sampling [s].
        settings: directions that count, size and segments of errors of form.

    Returns:
        Means (rivals, d) and covariances (rivals, d, d) [1].
    """
    n = len(runs)
    slopes = [tolerances_as_slopes(run).slopes for run in runs]
    expected = [
        own @ posterior.mean - run.residual
        for run, own, posterior in zip(runs, slopes, posteriors, strict=True)
    ]
    means = np.stack(expected, axis=1) - expected[0][:, None]
    spreads = [
        np.column_stack([own @ posterior.factor, run.run_slopes * run.run_sd])
        for run, own, posterior in zip(runs, slopes, posteriors, strict=True)
    ]
    columns = np.column_stack([means, *spreads])
    gram = columns.T @ columns
    if effects.shape[1]:
        errors = settings.form_error / np.sqrt(n) * effects
        gram -= explained_by_form_errors(columns, errors, channels, period, settings.segment_duration)
    coordinates = _coordinates(gram, settings.least_variance)
    ends = np.cumsum([n, *(spread.shape[1] for spread in spreads)])
    own = np.split(coordinates, ends[:-1], axis=1)
    covariances = [np.eye(len(coordinates)) + spread @ spread.T for spread in own[1:]]
    return own[0].T, np.stack(covariances)


def _coordinates(gram: NDArray, least_variance: float) -> NDArray:
    """Columns with these products (n, n) in the fewest coordinates, (d, n)."""
    values, vectors = np.linalg.eigh(gram)
    wide = values > least_variance * values[-1]
    return np.sqrt(values[wide])[:, None] * vectors[:, wide].T
