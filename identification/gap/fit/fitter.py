"""Joint refits of the calibrated parameters with causes: many hypotheses side by side in one batch."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.gap.fit.variable_projection import Linear, Normal, freed, normal
from identification.gap.model.grey_box import Cause, GreyBox, Nuisance, Size, weighted

STEP = 1e-3
"""Change of a scaled number for a finite difference."""

LOST = 1e3
"""Residual of a reading whose candidate could not be simulated, in noise deviations."""

ITERATIONS = 12
"""Of the damped Gauss-Newton method; a fit that needs more is reported as not converged."""

ENOUGH = 0.3
RELATIVE = 3e-3
"""Decrease of chi-square, predicted, and its share of the excess, at which a fit has converged.

Excess: chi-square beyond one per reading. A cause that leaves much need not leave it to the digit.
"""

HOPE = 3.0
"""Times the decrease that a step promises, which is all that a fit is trusted to gain yet."""

HOPELESS = 4.0
SLACK = 0.05
"""A fit is given up if its excess stays above this many times the least of its rivals, and this per
reading: noise is not known to the percent."""


@dataclass(frozen=True, kw_only=True)
class Hypothesis:
    """Causes that are taken to act together; none: the nominal model, recalibrated."""

    causes: tuple[Cause, ...]

    @property
    def sizes(self) -> tuple[Size, ...]:
        """What is fitted beside the calibrated parameters."""
        return tuple(size for cause in self.causes for size in cause.sizes)

    @property
    def local(self) -> tuple[Nuisance, ...]:
        """The causes' own numbers of every run."""
        return tuple(nuisance for cause in self.causes for nuisance in cause.local)

    @property
    def name(self) -> tuple[str, ...]:
        """The causes' labels."""
        return tuple(cause.label for cause in self.causes)


@dataclass(frozen=True, kw_only=True)
class Frame:
    """Derivatives by starts and tolerances, which enter linearly, taken at some point."""

    at: NDArray
    """Tolerances of the simulations, in standard deviations from their centres, (m,)."""
    starts: list[NDArray]
    """Per run (values, starts)."""
    shared: list[NDArray]
    """Per run (values, tolerances), per standard deviation."""


@dataclass(frozen=True, kw_only=True)
class Point:
    """Where the fit of a hypothesis is."""

    hypothesis: Hypothesis
    vector: NDArray
    """Calibrated parameters and sizes, scaled, (k,)."""
    local: NDArray
    """(runs, l) [SI]."""
    frame: Frame | None = None
    """Its own; None: the one that the fitter has for all."""
    chi_square: float = np.inf
    damping: float = 1e-3
    converged: bool = False
    given_up: bool = False

    @property
    def first_size(self) -> int:
        """Where the causes' sizes begin in the vector."""
        return len(self.vector) - len(self.hypothesis.sizes)


class Fitter:
    """Fits hypotheses to the runs that may be fitted to."""

    def __init__(self, plant: GreyBox, frame: Frame | None = None):
        self.plant = plant
        self.fitted = [r for r, run in enumerate(plant.runs) if not run.held_out]
        self.everything = list(range(len(plant.runs)))
        self.readings = sum(np.count_nonzero(plant.runs[r].trusted) for r in self.fitted)
        self.target = [weighted(plant, r, run.measured).reshape(-1) for r, run in enumerate(plant.runs)]
        empty = [np.zeros((len(target), 0)) for target in self.target]
        self.frame = frame or Frame(at=np.zeros(0), starts=empty, shared=empty)

    def start(self, hypothesis: Hypothesis, values: Mapping[str, float]) -> Point:
        """A point at values by symbol; what is left out begins where it is off."""
        symbols = (*self.plant.parameters, *hypothesis.sizes)
        vector = np.array([values.get(size.symbol, size.off) / size.scale for size in symbols])
        local = np.zeros((len(self.plant.runs), len(hypothesis.local)))
        return Point(hypothesis=hypothesis, vector=vector, local=local)

    def fit(self, points: Sequence[Point], rival: float = np.inf) -> list[Point]:
        """Damped Gauss-Newton on all points at once, until each has converged or is given up.

        rival: the least chi-square of earlier fits, beside which the points compete.
        """
        points = list(points)
        trials = [replace(point) for point in points]
        active = list(range(len(points)))
        equations: dict[int, Normal] = {}
        for _ in range(ITERATIONS + 1):
            best = rival
            for index, runs in zip(
                active, self.linearise([trials[i] for i in active], self.fitted), strict=True
            ):
                found = normal(runs)
                trial, point = trials[index], points[index]
                if found.chi_square < point.chi_square:
                    local = self._local(trial, runs, found)
                    damping = max(0.2 * point.damping, 1e-9)
                    points[index] = replace(
                        trial, chi_square=found.chi_square, damping=damping, local=local
                    )
                    equations[index] = found
                else:
                    points[index] = replace(point, damping=min(10.0 * point.damping + 1e-6, 1e6))
                trials[index], gain = self._step(points[index], equations[index])
                excess = points[index].chi_square - self.readings
                done = gain < max(ENOUGH, RELATIVE * excess) or points[index].damping >= 1e5
                hopeless = excess - HOPE * gain > self._hopeless(best)
                points[index] = replace(points[index], converged=bool(done), given_up=bool(hopeless))
            rival = min(rival, *(point.chi_square for point in points))
            active = [i for i in active if not (points[i].converged or points[i].given_up)]
            if not active:
                break
        return points

    def _hopeless(self, rival: float) -> float:
        """Excess with which a fit has lost against a rival's chi-square."""
        return HOPELESS * max(rival - self.readings, 0.0) + SLACK * self.readings

    def _local(self, point: Point, runs: Sequence[Linear], found: Normal) -> NDArray:
        """The runs' own numbers of the causes after one Gauss-Newton step; starts stay linear."""
        local = point.local.copy()
        l = local.shape[1]  # noqa: E741
        if l:
            for r, run in zip(self.fitted, runs, strict=True):
                local[r] += freed(run, found.shared)[1][:l]
        return local

    def _step(self, point: Point, equations: Normal) -> tuple[Point, float]:
        """The next trial, within the ranges, and the decrease of chi-square it promises."""
        sizes = self.sizes(point)
        low = np.array([min(s.low / s.scale, s.high / s.scale) for s in sizes])
        high = np.array([max(s.low / s.scale, s.high / s.scale) for s in sizes])
        ends = np.minimum(low - point.vector, 0.0), np.maximum(high - point.vector, 0.0)
        step, gain = equations.step(*ends, point.damping)
        return replace(point, vector=point.vector + step), gain

    def frame_of(self, point: Point) -> Frame:
        """The derivatives by starts and tolerances that hold for a point."""
        return point.frame or self.frame

    def linearise(self, points: Sequence[Point], runs: Sequence[int]) -> list[list[Linear]]:
        """Residuals and derivatives of each point in each of the runs, all simulated side by side."""
        changed = [self._changed(point) for point in points]
        ends = np.cumsum([0, *(len(each) for each in changed)])
        flat = self._weighted([candidate for each in changed for candidate in each], runs)
        return [
            [self._linear(point, r, block[:, first:last]) for r, block in zip(runs, flat, strict=True)]
            for point, first, last in zip(points, ends[:-1], ends[1:], strict=True)
        ]

    def residuals(self, points: Sequence[Point], runs: Sequence[int]) -> list[NDArray]:
        """Weighted measured - model of each point, per run (values, points)."""
        return [
            np.nan_to_num(self.target[r][:, None] - y, nan=LOST)
            for r, y in zip(runs, self._weighted(points, runs), strict=True)
        ]

    def columns(self, points: Sequence[Point]) -> dict[str, NDArray]:
        """Values by symbol of points side by side, as `GreyBox.outputs` takes them."""
        n = len(points)
        found: dict[str, NDArray] = {}
        for i, point in enumerate(points):
            for size, scaled in zip(self.sizes(point), point.vector, strict=True):
                found.setdefault(size.symbol, np.full(n, size.off, dtype=float))[i] = scaled * size.scale
            for nuisance, own in zip(point.hypothesis.local, point.local.T, strict=True):
                every = np.full((n, len(self.plant.runs)), nuisance.centre)
                found.setdefault(nuisance.symbol, every)[i] = own
            # A cause may set the same parameter: the unit's scatter goes on top of that.
            at = self.frame_of(point).at
            for tolerance, share in zip(self.plant.tolerances[: len(at)], at, strict=True):
                centre = np.full(n, tolerance.centre, dtype=float)
                found.setdefault(tolerance.symbol, centre)[i] += share * tolerance.sd
        return found

    def _weighted(self, points: Sequence[Point], runs: Sequence[int]) -> list[NDArray]:
        """Weighted outputs of the points, per run (values, points)."""
        outputs = self.plant.outputs(self.columns(points), runs)
        return [
            weighted(self.plant, r, output).reshape(-1, len(points))
            for r, output in zip(runs, outputs, strict=True)
        ]

    def _changed(self, point: Point) -> list[Point]:
        """The point, then each of its numbers, and of its runs' own, changed by a step."""
        found = [point]
        for i, step in enumerate(self._steps(point)):
            vector = point.vector.copy()
            vector[i] += step
            found.append(replace(point, vector=vector))
        for j, nuisance in enumerate(point.hypothesis.local):
            local = point.local.copy()
            local[:, j] += nuisance.step
            found.append(replace(point, local=local))
        return found

    def _linear(self, point: Point, run: int, block: NDArray) -> Linear:
        k, starts, frame = len(point.vector), self.plant.starts, self.frame_of(point)
        own = np.array([n.step for n in point.hypothesis.local])
        # of no tolerance at all, as the derivatives have it: what is added is taken away again
        residual = np.nan_to_num(self.target[run] - block[:, 0], nan=LOST) + frame.shared[run] @ frame.at
        changes = np.nan_to_num(block[:, 1:] - block[:, :1])
        local = np.column_stack([changes[:, k:] / own, frame.starts[run]])
        linear_starts = frame.starts[run].shape[1]
        sd = [n.sd for n in point.hypothesis.local] + [n.sd for n in starts][:linear_starts]
        return Linear(
            residual=residual,
            slopes=changes[:, :k] / self._steps(point),
            local=local,
            local_value=np.concatenate([point.local[run], np.zeros(linear_starts)]),
            local_sd=np.array(sd),
            shared=frame.shared[run],
        )

    def _steps(self, point: Point) -> NDArray:
        """Finite differences of the scaled vector, away from the nearer end of each range."""
        sizes = self.sizes(point)
        middle = np.array([0.5 * (s.low + s.high) / s.scale for s in sizes])
        return np.where(point.vector > middle, -STEP, STEP) * np.maximum(np.abs(point.vector), 0.1)

    def sizes(self, point: Point) -> tuple[Size, ...]:
        """What the point's vector holds: the calibrated parameters, then its causes' sizes."""
        return (*self.plant.parameters, *point.hypothesis.sizes)

    def values(self, point: Point) -> dict[str, float]:
        """Parameters and sizes by symbol [SI]."""
        pairs = zip(self.sizes(point), point.vector, strict=True)
        return {size.symbol: float(scaled * size.scale) for size, scaled in pairs}


def frames(fitter: Fitter, points: Sequence[Point], at: Sequence[NDArray]) -> list[Frame]:
    """Derivatives by starts and tolerances at each point, by differences over all runs at once.

    at: tolerances (m,) of each point, in standard deviations.
    """
    plant = fitter.plant
    nuisances = (*plant.starts, *plant.tolerances)
    n = 1 + len(nuisances)
    found = [Frame(at=own, starts=[], shared=[]) for own in at]
    placed = [replace(point, frame=frame) for point, frame in zip(points, found, strict=True)]
    values = fitter.columns([point for point in placed for _ in range(n)])
    for j, nuisance in enumerate(nuisances, start=1):
        centre = np.full(n * len(points), nuisance.centre, dtype=float)
        values.setdefault(nuisance.symbol, centre)[j::n] += nuisance.step
    steps = np.array([nuisance.step for nuisance in nuisances])
    sd = np.array([nuisance.sd for nuisance in plant.tolerances])
    for r, output in enumerate(plant.outputs(values, fitter.everything)):
        flat = weighted(plant, r, output).reshape(-1, len(points), n)
        slopes = np.nan_to_num(flat[..., 1:] - flat[..., :1]) / steps
        for frame, own in zip(found, slopes.transpose(1, 0, 2), strict=True):
            frame.starts.append(own[:, : len(plant.starts)])
            frame.shared.append(own[:, len(plant.starts) :] * sd)
    return found
