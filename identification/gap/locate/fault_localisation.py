"""Where the gap lies: in which channel and regime, and which equation lacks something of what shape."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.fitter import Fitter, Point
from identification.gap.locate.forcing import Material, Window, candidate, needed, telling_runs
from identification.gap.locate.forcing_processes import FREE, SLOW, Course, averaged, courses
from identification.gap.locate.regimes import RegimeGap, regime_gaps
from identification.gap.model.grey_box import Equation

NOTHING = 0.9
"""Probability, before any data, that nothing is missing: an equation is named on clear evidence only."""

READING = 0.3
"""Probability of a fault of the readings, relative to that of an equation, before any data."""


DOUBT = 0.5
"""Of evidences, relative to the root of the greatest: so much do forms err that are not quite right."""


@dataclass(frozen=True, kw_only=True)
class Shape:
    """The missing term of an equation over the state that explains it best, in people's units."""

    equation: Equation
    state: str
    state_unit: str
    x: NDArray
    """(windows,), rising."""
    y: NDArray
    """Forcing as a function of the state."""
    sd: NDArray
    scatter: NDArray
    """Forcing that each window needs by itself."""
    explained: float
    """Share of what the forcing explains that the curve alone does: little where no one state tells."""


@dataclass(frozen=True, kw_only=True)
class Forcing:
    """The least forcing of one equation, or fault of the readings, that the residual needs."""

    equation: Equation
    log_evidence: float
    """Relative to no forcing."""
    explained: float
    """Share of the misfit beyond noise that it takes away; 0 where there is none."""
    windows: list[Window]
    forcing: NDArray
    """(windows,), in the equation's unit."""
    sd: NDArray


@dataclass(frozen=True, kw_only=True)
class Where:
    """Where the gap lies. Probabilities of `equation` and `none` sum to 1."""

    channel: Mapping[str, float]
    """Root mean square of (model - measured)/noise on held-out runs; 1 is the floor."""
    regimes: list[RegimeGap]
    equation: Mapping[str, float]
    """Probability that the missing physics lies there: each state equation and fault of the readings."""
    none: float
    """Probability that nothing is missing."""
    forcings: list[Forcing]
    """The likeliest first."""
    shape: Shape | None
    """Of the likeliest equation; None where nothing is missing or the readings are at fault."""


def locate(fitter: Fitter, point: Point, residuals: Sequence[NDArray], seed: int) -> Where:
    """Locate what a point, the recalibrated model or one with causes, leaves.

    residuals: per run (channels, samples), in noise deviations, as `Assessed.residuals`.
    """
    plant, values = fitter.plant, candidate(fitter, point)
    masks = [plant.regimes(values, r) for r in fitter.everything]
    material, forms = needed(fitter, point, telling_runs(fitter, residuals))
    guesses = courses(forms, material)
    evidence = np.array([averaged(found) for found in guesses])
    weights = _probabilities(evidence, [READING if not form.windows else 1.0 for form in forms])
    order = np.argsort(-evidence, kind="stable")
    likeliest = guesses[int(np.argmax(weights[:-1]))]
    missing = weights[-1] < np.max(weights[:-1])
    return Where(
        channel=_channels(fitter, residuals),
        regimes=regime_gaps(plant, masks, residuals, seed),
        equation={equation.name: 0.0 for equation in plant.equations}
        | {form.equation.name: float(w) for form, w in zip(forms, weights[:-1], strict=True)},
        none=float(weights[-1]),
        forcings=[_forcing(guesses[i][0], float(evidence[i]), material) for i in order],
        shape=_shape(likeliest, material.units) if missing else None,
    )


def _probabilities(evidence: NDArray, shares: Sequence[float]) -> NDArray:
    """Of each place, by its share before any data, and last that nothing is missing."""
    doubt = max(1.0, DOUBT * np.sqrt(max(float(np.max(evidence)), 0.0)))
    prior = (1 - NOTHING) * np.array(shares) / np.sum(shares)
    score = np.append(evidence / doubt + np.log(prior), np.log(NOTHING))
    weights = np.exp(score - np.max(score))
    return weights / np.sum(weights)


def _channels(fitter: Fitter, residuals: Sequence[NDArray]) -> dict[str, float]:
    """Gap by channel on held-out runs, or on all where none is held out."""
    runs = [r for r, run in enumerate(fitter.plant.runs) if run.held_out] or fitter.everything
    squares = np.sum([np.sum(residuals[r] ** 2, axis=1) for r in runs], axis=0)
    counts = np.sum([np.sum(fitter.plant.runs[r].trusted, axis=1) for r in runs], axis=0)
    gaps = np.sqrt(squares / np.maximum(counts, 1))
    return {channel.name: float(gap) for channel, gap in zip(fitter.plant.channels, gaps, strict=True)}


def _forcing(course: Course, log_evidence: float, material: Material) -> Forcing:
    equation = course.needed.equation
    gap = material.chi_square - material.count
    share = course.explained * material.chi_square / gap if gap > 0 and log_evidence > 0 else 0.0
    size = equation.step / equation.scale
    return Forcing(
        equation=equation,
        log_evidence=log_evidence,
        explained=min(share, 1.0),
        windows=course.needed.windows,
        forcing=size * course.forcing,
        sd=size * course.sd,
    )


def _shape(found: Sequence[Course], units: Mapping[str, tuple[str, float]]) -> Shape | None:
    """From the function of a state that explains most by itself."""
    of_states = [course for course in found if course.kind not in (FREE, SLOW)]
    if not of_states:
        return None
    course = max(of_states, key=lambda course: course.smooth_explained)
    equation, (unit, scale) = course.needed.equation, units[course.kind]
    size = equation.step / equation.scale
    x = np.array([window.states[course.kind] for window in course.needed.windows]) / scale
    order = np.argsort(x, kind="stable")
    return Shape(
        equation=equation,
        state=course.kind,
        state_unit=unit,
        x=x[order],
        y=size * course.smooth[order],
        sd=size * course.smooth_sd[order],
        scatter=size * course.forcing[order],
        explained=float(np.clip(course.smooth_explained / course.explained, 0.0, 1.0)),
    )
