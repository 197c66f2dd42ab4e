"""How a forcing may vary from window to window, and what speaks for it: Gaussian processes, evidence.

A missing term is either a function of one state, or a course of its own in time. Each guess is a
Gaussian process over the windows; its amplitude is integrated over (a logarithmic grid). Where a forcing
leaves more than noise, what it leaves stands in for the noise: an equation that explains half of a large
misfit does not win by the size of the misfit alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from identification.gap.locate.forcing import Material, Needed, Window

AMPLITUDES = np.logspace(-3, 9, 37)
"""Variances of a forcing, relative to what the readings tell of it on the average."""

LENGTH = 0.2
"""Over which a function of a state varies, relative to the state's range."""

ROUGH = 1e-3
"""Variance, relative to the whole, by which single windows may depart from a smooth course."""

MEMORY = 0.02
"""Over which a slow course in time varies, relative to the longest run's duration."""

TOLD = 1e-7
"""Share of the best-told direction's precision below which a direction of forcings is left out."""

RIVAL = 0.5
"""Equations that explain less than this share of what the best one does are not looked at closely."""

FREE, SLOW = "free", "slow"
"""Courses in time: each window on its own, or like its neighbours; other courses bear a state's name."""


@dataclass(frozen=True, kw_only=True)
class Course:
    """One guess of how the forcing varies, with the forcing that it estimates."""

    needed: Needed
    kind: str
    """FREE, SLOW, or the state whose function it is."""
    log_evidence: float
    """Relative to no forcing."""
    explained: float
    """Share of chi-square that the forcing takes away."""
    forcing: NDArray
    """Estimate in each window, in steps of the equation, (windows,)."""
    sd: NDArray
    smooth: NDArray
    """The same without what single windows have of their own."""
    smooth_sd: NDArray
    smooth_explained: float
    """As `explained`, by that part alone."""


def courses(forms: Sequence[Needed], material: Material) -> list[list[Course]]:
    """Every guess for each equation, its likeliest first.

    Functions of states are tried only for equations that explain about as much as the best one.
    """
    told = [_Told(form) for form in forms]
    found = [
        [_course(each, material, kind) for kind in ((FREE, SLOW) if form.windows else (FREE,))]
        for form, each in zip(forms, told, strict=True)
    ]
    enough = RIVAL * max(mine[0].explained for mine in found)
    for form, each, mine in zip(forms, told, found, strict=True):
        if form.windows and mine[0].explained >= enough:
            mine += [_course(each, material, state) for state in material.units]
        mine.sort(key=lambda course: -course.log_evidence)
    return found


def averaged(found: Sequence[Course]) -> float:
    """Log evidence of an equation whose courses are equally likely beforehand."""
    return float(logsumexp([course.log_evidence for course in found]) - np.log(len(found)))


class _Told:
    """An equation's forcings in the directions that the readings tell: precision = root root'."""

    def __init__(self, form: Needed):
        precision, axes = np.linalg.eigh(form.precision)
        kept = precision > TOLD * max(precision[-1], np.finfo(float).tiny)
        self.form = form
        self.root = axes[:, kept] * np.sqrt(precision[kept])
        self.pull = (axes[:, kept].T @ form.pull) / np.sqrt(precision[kept])


def _covariance(form: Needed, kind: str) -> tuple[NDArray, float]:
    """Covariance of the smooth part between windows, and variance of each window's own part."""
    m, windows = len(form.pull), form.windows
    if kind == FREE:
        return np.zeros((m, m)), 1.0
    if kind == SLOW:
        return _slow(windows), ROUGH
    x = np.array([window.states[kind] for window in windows])
    distance = (x[:, None] - x) / (LENGTH * max(float(np.ptp(x)), np.finfo(float).tiny))
    return np.exp(-0.5 * distance**2), ROUGH


def _slow(windows: Sequence[Window]) -> NDArray:
    run = np.array([window.run for window in windows])
    time = np.array([0.5 * (window.begin + window.end) for window in windows])
    memory = MEMORY * max(window.end for window in windows)
    return np.where(run[:, None] == run, np.exp(-np.abs(time[:, None] - time) / memory), 0.0)


def _course(told: _Told, material: Material, kind: str) -> Course:
    """Evidence over the amplitudes, and the forcing at the likeliest of them."""
    smooth, own = _covariance(told.form, kind)
    part = smooth @ told.root
    full = part + own * told.root
    strength, axes = np.linalg.eigh(told.root.T @ full)
    strength = np.maximum(strength, 0.0)
    pull = axes.T @ told.pull
    # Where no reading tells of this forcing there is no strength, and any amplitude will do.
    amplitude = AMPLITUDES / (np.mean(strength) if np.any(strength) else 1.0)
    shrunk = amplitude[:, None] / (1.0 + amplitude[:, None] * strength)
    explained = (shrunk * strength) @ pull**2
    n, chi_square = material.count, material.chi_square
    noise = np.maximum(1.0, (chi_square - explained) / n)
    before = max(1.0, chi_square / n)
    evidence = 0.5 * (
        chi_square / before - (chi_square - explained) / noise - n * np.log(noise / before)
        - np.sum(np.log1p(amplitude[:, None] * strength), axis=1)
    )  # fmt: skip
    best = int(np.argmax(evidence))
    weight, scale = shrunk[best], amplitude[best] * noise[best]
    part, full = part @ axes, full @ axes
    curve = part @ (weight * pull)
    form = told.form
    return Course(
        needed=form,
        kind=kind,
        log_evidence=float(logsumexp(evidence) - np.log(len(evidence))),
        explained=float(explained[best] / chi_square),
        forcing=full @ (weight * pull),
        sd=np.sqrt(scale * np.maximum(np.diag(smooth) + own - full**2 @ weight, 0.0)),
        smooth=curve,
        smooth_sd=np.sqrt(scale * np.maximum(np.diag(smooth) - part**2 @ weight, 0.0)),
        smooth_explained=float((2 * form.pull - form.precision @ curve) @ curve / chi_square),
    )
