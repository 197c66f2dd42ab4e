"""Fitting the four calibrated parameters of the nominal model to many made-up valves at once.

Each problem minimises the report's total error (eq. 21) over tests 1 to 4, as its calibration did, by
Levenberg-Marquardt from Table 12. A trial costs five lanes: itself, and a step in each parameter, so
that an accepted trial brings its derivatives along.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.parameters import Parameters, confidence_intervals
from identification.recordings.recording import OUTPUTS
from identification.replay.batch_simulation import Replay
from identification.replay.model_inputs import ModelInputs
from identification.replay.parameter_vector import ParameterVector

SYMBOLS = tuple(confidence_intervals())
"""The four calibrated parameters."""

STEP = 1e-3
"""Relative change of a parameter for a finite difference."""

ITERATIONS = 5

ENOUGH = 5e-3
"""Relative fall of the sum of squares below which a problem is done: a quarter of a percent of
an error."""

LARGEST_STEP = 0.3
"""Relative; farther away the derivatives say nothing."""

LEAST, MOST = 1 / 3, 3.0
"""Bounds relative to Table 12. The domains would be narrower; but what counts is the pattern that is
left, and a cause that scales a parameter leaves the same one at every scale."""


def vector() -> ParameterVector:
    """The four parameters relative to Table 12."""
    return ParameterVector(SYMBOLS, Parameters.calibrated())


class Fits:
    """The state of n fits; arrays have n rows."""

    def __init__(self, drives: Sequence[ModelInputs], truths: Sequence[NDArray]):
        self.replay = Replay(drives, Parameters.calibrated())
        self.truths = truths
        self.p2_shift = start_shift(drives, truths)
        self.weights = [relative_weights(truth) for truth in truths]
        n = truths[0].shape[2]
        self.z = np.ones((n, len(SYMBOLS)))
        self.cost, self.gradient, self.curvature = self.normal_equations(self.z, np.arange(n))
        self.damping = np.full(n, 1e-3)
        self.active = np.isfinite(self.cost)

    def iterate(self) -> None:
        """One trial step of every fit that has not converged."""
        which = np.flatnonzero(self.active)
        trial = np.clip(self.z[which] + self._step(which), LEAST, MOST)
        cost, gradient, curvature = self.normal_equations(trial, which)
        fall = self.cost[which] - cost
        better = fall > 0
        self.active[which[better & (fall < ENOUGH * self.cost[which])]] = False
        self.damping[which] *= np.where(better, 0.1, 10.0)
        accepted = which[better]
        self.z[accepted], self.cost[accepted] = trial[better], cost[better]
        self.gradient[accepted], self.curvature[accepted] = gradient[better], curvature[better]

    def _step(self, which: NDArray) -> NDArray:
        """Marquardt's step, (m, 4); a parameter without any influence stays."""
        identity = np.eye(len(SYMBOLS))
        curvature = self.curvature[which]
        diagonal = np.einsum("nii->ni", curvature) + 1e-9
        damped = curvature + np.einsum("n,ni,ij->nij", self.damping[which], diagonal, identity)
        solved = np.linalg.solve(damped + 1e-12 * identity, self.gradient[which][:, :, None])
        return np.clip(solved[:, :, 0], -LARGEST_STEP, LARGEST_STEP)

    def normal_equations(self, z: NDArray, which: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Of the m fits `which` at z: sum of squares (m,), minus half its gradient (m, 4), and half its
        curvature (m, 4, 4)."""
        m, k = z.shape
        steps = STEP * np.vstack([np.zeros(k), np.eye(k)])
        lanes = vector().values((z[:, None, :] + steps).reshape(-1, k))
        total = np.zeros((m, k + 1, k + 1))
        outputs = self.replay.outputs(lanes, np.repeat(self.p2_shift[which], k + 1))
        for model, truth, weight in zip(outputs, self.truths, self.weights, strict=True):
            total += _products(model, truth[..., which], weight[..., which])
        lost = ~np.isfinite(total).all(axis=(1, 2))
        total[lost] = 0.0
        cost = np.where(lost, np.inf, total[:, 0, 0])
        return cost, total[:, 1:, 0], total[:, 1:, 1:]


def recalibrated(drives: Sequence[ModelInputs], truths: Sequence[NDArray]) -> NDArray:
    """Fitted parameters relative to Table 12, (n, 4), of n valves.

    truths: their outputs in each of the tests `drives`, (3, samples, n).
    """
    fits = Fits(drives, truths)
    for _ in range(ITERATIONS):
        if np.any(fits.active):
            fits.iterate()
    return fits.z


def start_shift(drives: Sequence[ModelInputs], truths: Sequence[NDArray]) -> NDArray:
    """What the sensor of p2 shows at the start beyond the true pressure [Pa], (n,).

    The model starts where the recording does, as in the report.
    """
    return truths[0][OUTPUTS.index("p2"), 0] - drives[0].p2_start


def relative_weights(truth: NDArray) -> NDArray:
    """Eq. 19's: root of each sample's share of the time, over the output's mean, (3, samples, n)."""
    share = np.full(truth.shape[1], 1.0 / (truth.shape[1] - 1))
    share[[0, -1]] *= 0.5
    mean = np.einsum("osn,s->on", truth, share)
    return np.sqrt(share)[None, :, None] / mean[:, None, :]


def _products(model: NDArray, truth: NDArray, weight: NDArray) -> NDArray:
    """Inner products of residual and slopes, the residual first, (m, 1 + k, 1 + k)."""
    lanes = model.reshape(*truth.shape, -1)
    columns = np.empty(lanes.shape)
    columns[..., 0] = weight * (truth - lanes[..., 0])
    columns[..., 1:] = (weight / STEP)[..., None] * (lanes[..., 1:] - lanes[..., :1])
    rows = np.moveaxis(columns, 2, 0).reshape(truth.shape[2], -1, lanes.shape[-1])
    return rows.transpose(0, 2, 1) @ rows
