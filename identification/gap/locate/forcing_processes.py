"""Gaussian processes of the forcing: how it may vary from window to window, and their evidence.

A missing term is a function of one state or varies in time. Each assumption is a Gaussian process over
the windows (Rasmussen and Williams 2006), whose evidence is averaged over a grid of amplitudes. Where a
forcing leaves more than noise, the remaining mean square replaces the noise variance. So an equation
that explains half of a large residual does not win by the size of the residual alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from identification.gap.locate.forcing import LocalisationDesign, QuadraticForm
from identification.gap.locate.settings import LocalisationSettings
from identification.gap.locate.windows import Window

FREE, SLOW = "free", "slow"
"""Processes in time: independent windows, or neighbours alike. Other processes bear a state's name."""


@dataclass(frozen=True, kw_only=True)
class ProcessFit:
    """A Gaussian process fitted to the forcing of one equation."""

    form: QuadraticForm
    kind: str
    """FREE, SLOW, or the name of the state whose function the forcing is."""
    log_evidence: float
    """Natural logarithm, relative to no forcing."""
    explained: float
    """Share of chi-square that the forcing removes [1]."""
    forcing: NDArray
    """Posterior mean of the forcing, (windows,) [steps of the equation]."""
    sd: NDArray
    """Its posterior standard deviation, (windows,) [steps of the equation]."""
    smooth: NDArray
    """Posterior mean of its smooth part, without what single windows have of their own, (windows,)
    [steps of the equation]."""
    smooth_sd: NDArray
    """Posterior standard deviation of the smooth part, (windows,) [steps of the equation]."""
    smooth_explained: float
    """Share of chi-square that the smooth part removes alone [1]."""


def fit_processes(
    forms: Sequence[QuadraticForm], design: LocalisationDesign, settings: LocalisationSettings
) -> list[list[ProcessFit]]:
    """Every process for each equation, by falling evidence.

    Functions of states are tried only for equations that explain about as much as the best one.
    """
    subspaces = [IdentifiableSubspace(form, settings.identifiable_share) for form in forms]
    fits = [
        [_fit(own, design, kind, settings) for kind in ((FREE, SLOW) if own.form.windows else (FREE,))]
        for own in subspaces
    ]
    enough = settings.rival_share * max(own_fits[0].explained for own_fits in fits)
    for subspace, own_fits in zip(subspaces, fits, strict=True):
        if subspace.form.windows and own_fits[0].explained >= enough:
            own_fits += [_fit(subspace, design, state, settings) for state in design.units]
        own_fits.sort(key=lambda fit: -fit.log_evidence)
    return fits


def average_log_evidence(fits: Sequence[ProcessFit]) -> float:
    """Log evidence of an equation whose processes are equally likely before the data."""
    return float(logsumexp([fit.log_evidence for fit in fits]) - np.log(len(fits)))


class IdentifiableSubspace:
    """The d directions of an equation's forcings that the readings determine."""

    def __init__(self, form: QuadraticForm, least_share: float):
        """Keep the directions with at least this share of the highest precision [1]."""
        precision, axes = np.linalg.eigh(form.precision)
        kept = precision > least_share * max(precision[-1], np.finfo(float).tiny)
        self.form = form
        self.root = axes[:, kept] * np.sqrt(precision[kept])
        """Square root of the precision, precision = root root', (windows, d)."""
        self.moment = (axes[:, kept].T @ form.moment) / np.sqrt(precision[kept])
        """Moment of the whitened directions, (d,)."""


def _covariance(form: QuadraticForm, kind: str, settings: LocalisationSettings) -> tuple[NDArray, float]:
    """Prior covariance of the smooth part (windows, windows), and variance of each window's own part."""
    count, windows = len(form.moment), form.windows
    if kind == FREE:
        return np.zeros((count, count)), 1.0
    if kind == SLOW:
        return _slow_covariance(windows, settings.time_memory), settings.rough_variance
    x = np.array([window.states[kind] for window in windows])
    length = settings.state_length * max(float(np.ptp(x)), np.finfo(float).tiny)
    distance = (x[:, None] - x) / length
    return np.exp(-0.5 * distance**2), settings.rough_variance


def _slow_covariance(windows: Sequence[Window], time_memory: float) -> NDArray:
    """Exponential covariance in time within each run, (windows, windows) [1]."""
    run = np.array([window.run for window in windows])
    time = np.array([0.5 * (window.begin + window.end) for window in windows])
    memory = time_memory * max(window.end for window in windows)
    return np.where(run[:, None] == run, np.exp(-np.abs(time[:, None] - time) / memory), 0.0)


def _fit(
    subspace: IdentifiableSubspace,
    design: LocalisationDesign,
    kind: str,
    settings: LocalisationSettings,
) -> ProcessFit:
    """Evidence averaged over the amplitudes, and the forcing at the most likely amplitude."""
    smooth, own = _covariance(subspace.form, kind, settings)
    smooth_root = smooth @ subspace.root
    root = smooth_root + own * subspace.root
    strength, axes = np.linalg.eigh(subspace.root.T @ root)
    strength = np.maximum(strength, 0.0)
    moment = axes.T @ subspace.moment
    # Where no reading tells of this forcing every strength is 0, and any amplitude will do.
    grid = np.logspace(*settings.amplitude_decades, settings.amplitudes)
    amplitudes = grid / (np.mean(strength) if np.any(strength) else 1.0)
    weights = amplitudes[:, None] / (1.0 + amplitudes[:, None] * strength)
    explained = (weights * strength) @ moment**2
    noise = np.maximum(1.0, (design.chi_square - explained) / design.readings)
    volume = np.sum(np.log1p(amplitudes[:, None] * strength), axis=1)
    evidence = _log_evidences(design, explained, noise, volume)
    best = int(np.argmax(evidence))
    weight, scale = weights[best], amplitudes[best] * noise[best]
    smooth_root, root = smooth_root @ axes, root @ axes
    curve = smooth_root @ (weight * moment)
    form, variance = subspace.form, np.diag(smooth)
    smooth_explained = (2 * form.moment - form.precision @ curve) @ curve / design.chi_square
    return ProcessFit(
        form=form,
        kind=kind,
        log_evidence=float(logsumexp(evidence) - np.log(len(evidence))),
        explained=float(explained[best] / design.chi_square),
        forcing=root @ (weight * moment),
        sd=np.sqrt(scale * np.maximum(variance + own - root**2 @ weight, 0.0)),
        smooth=curve,
        smooth_sd=np.sqrt(scale * np.maximum(variance - smooth_root**2 @ weight, 0.0)),
        smooth_explained=float(smooth_explained),
    )


def _log_evidences(
    design: LocalisationDesign, explained: NDArray, noise: NDArray, volume: NDArray
) -> NDArray:
    """Log evidence at each amplitude, relative to no forcing, (amplitudes,).

    explained: decrease of chi-square. noise: variance of what is left, at least 1. volume: log
    determinant of the prior's widening.
    """
    n, chi_square = design.readings, design.chi_square
    before = max(1.0, chi_square / n)
    return 0.5 * (
        chi_square / before - (chi_square - explained) / noise - n * np.log(noise / before) - volume
    )
