"""Fitting the four calibrated parameters of the nominal model to many hypothetical valves at once.

Each problem minimises the report's total error (eq. 21) over tests 1 to 4, as its calibration did, by
Levenberg-Marquardt (Marquardt 1963) from Table 12. A trial step simulates five lanes: the point itself,
and a step in each parameter. So an accepted trial has its derivatives already.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.parameters import Parameters
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.recordings.recording import OUTPUTS
from identification.replay.batch_simulation import Replay
from identification.replay.model_inputs import ModelInputs
from identification.replay.parameter_vector import ParameterVector
from identification.studies.error_tables.settings import DEFAULTS, ErrorTableSettings


def calibrated_vector() -> ParameterVector:
    """The four calibrated parameters relative to Table 12."""
    return ParameterVector(CALIBRATED_SYMBOLS, Parameters.calibrated())


class BatchFit:
    """Levenberg-Marquardt for n fits of k = 4 parameters at once; arrays have n rows."""

    z: NDArray
    """Parameters relative to Table 12 [-], (n, k)."""
    cost: NDArray
    """Sum of squares [-], (n,); infinite where the model cannot be integrated."""
    gradient: NDArray
    """Minus half the gradient of the cost [-], (n, k)."""
    curvature: NDArray
    """Half the Gauss-Newton curvature of the cost [-], (n, k, k)."""
    damping: NDArray
    """Marquardt's damping [-], (n,)."""
    active: NDArray
    """Fits that have not converged, boolean (n,)."""

    def __init__(
        self,
        drives: Sequence[ModelInputs],
        truths: Sequence[NDArray],
        settings: ErrorTableSettings = DEFAULTS,
    ):
        """Evaluate all fits at Table 12.

        drives: the fitted tests. truths: outputs [SI] in each of them, (3, samples, n).
        """
        self.settings = settings
        self.replay = Replay(drives, Parameters.calibrated())
        self.truths = truths
        self.p2_shift = start_shift(drives, truths)
        self.weights = [relative_weights(truth) for truth in truths]
        n = truths[0].shape[2]
        self.z = np.ones((n, len(CALIBRATED_SYMBOLS)))
        self.cost, self.gradient, self.curvature = self.normal_equations(self.z, np.arange(n))
        self.damping = np.full(n, settings.initial_damping)
        self.active = np.isfinite(self.cost)

    def iterate(self) -> None:
        """One trial step of every fit that has not converged."""
        fits = np.flatnonzero(self.active)
        trial = np.clip(self.z[fits] + self._step(fits), *self.settings.parameter_bounds)
        cost, gradient, curvature = self.normal_equations(trial, fits)
        decrease = self.cost[fits] - cost
        better = decrease > 0
        converged = better & (decrease < self.settings.converged_decrease * self.cost[fits])
        self.active[fits[converged]] = False
        self.damping[fits] *= np.where(better, *self.settings.damping_factors)
        accepted = fits[better]
        self.z[accepted], self.cost[accepted] = trial[better], cost[better]
        self.gradient[accepted], self.curvature[accepted] = gradient[better], curvature[better]

    def _step(self, fits: NDArray) -> NDArray:
        """Marquardt's step of m fits (indices), (m, k); a parameter without influence stays."""
        identity = np.eye(len(CALIBRATED_SYMBOLS))
        curvature = self.curvature[fits]
        diagonal = np.einsum("nii->ni", curvature) + 1e-9
        damped = curvature + np.einsum("n,ni,ij->nij", self.damping[fits], diagonal, identity)
        solved = np.linalg.solve(damped + 1e-12 * identity, self.gradient[fits][:, :, None])
        largest = self.settings.largest_step
        return np.clip(solved[:, :, 0], -largest, largest)

    def normal_equations(self, z: NDArray, fits: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Cost (m,), minus half its gradient (m, k) and half its curvature (m, k, k), all [-].

        Args:
            z: parameters of m fits relative to Table 12 [-], (m, k).
            fits: indices of these fits, (m,).
        """
        m, k = z.shape
        step = self.settings.difference_step
        steps = step * np.vstack([np.zeros(k), np.eye(k)])
        lanes = calibrated_vector().values((z[:, None, :] + steps).reshape(-1, k))
        total = np.zeros((m, k + 1, k + 1))
        outputs = self.replay.outputs(lanes, np.repeat(self.p2_shift[fits], k + 1))
        for model, truth, weight in zip(outputs, self.truths, self.weights, strict=True):
            total += _products(model, truth[..., fits], weight[..., fits], step)
        lost = ~np.isfinite(total).all(axis=(1, 2))
        total[lost] = 0.0
        cost = np.where(lost, np.inf, total[:, 0, 0])
        return cost, total[:, 1:, 0], total[:, 1:, 1:]


def recalibrated(
    drives: Sequence[ModelInputs], truths: Sequence[NDArray], settings: ErrorTableSettings = DEFAULTS
) -> NDArray:
    """Fitted parameters of n valves relative to Table 12 [-], (n, 4).

    Args:
        drives: the fitted tests.
        truths: outputs of the valves in each of these tests [SI], (3, samples, n).
    """
    batch = BatchFit(drives, truths, settings)
    for _ in range(settings.iterations):
        if np.any(batch.active):
            batch.iterate()
    return batch.z


def start_shift(drives: Sequence[ModelInputs], truths: Sequence[NDArray]) -> NDArray:
    """Reading of p2 at the start less the true pressure [Pa], (n,).

    The model starts where the recording does, as in the report. truths: outputs [SI], (3, samples, n).
    """
    return truths[0][OUTPUTS.index("p2"), 0] - drives[0].p2_start


def relative_weights(truth: NDArray) -> NDArray:
    """Weights of eq. 19 [1/SI]: root of each sample's share of the time, over the output's mean.

    truth: outputs [SI], (3, samples, n), the shape of the result.
    """
    share = np.full(truth.shape[1], 1.0 / (truth.shape[1] - 1))
    share[[0, -1]] *= 0.5
    mean = np.einsum("osn,s->on", truth, share)
    return np.sqrt(share)[None, :, None] / mean[:, None, :]


def _products(model: NDArray, truth: NDArray, weight: NDArray, step: float) -> NDArray:
    """Inner products of residual and slopes, the residual first [-], (m, 1 + k, 1 + k)."""
    lanes = model.reshape(*truth.shape, -1)
    columns = np.empty(lanes.shape)
    columns[..., 0] = weight * (truth - lanes[..., 0])
    columns[..., 1:] = (weight / step)[..., None] * (lanes[..., 1:] - lanes[..., :1])
    rows = np.moveaxis(columns, 2, 0).reshape(truth.shape[2], -1, lanes.shape[-1])
    return rows.transpose(0, 2, 1) @ rows
