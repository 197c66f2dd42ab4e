"""How far the model is from recordings, as a weighted residual, and how parameters move it.

Two weightings: by the measured noise (least squares), and that of the report's total error, whose square
(eqs 19-21) is a weighted sum of squares too. What a recording does not tell of itself exactly - its
circuit pressure at the start, the zero of the p3 and I sensors on that day - is a nuisance: few numbers
per recording, in which the outputs are as good as linear. They are solved for at every candidate
(variable projection, Golub & Pereyra 1973), so the optimiser sees the parameters alone.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from identification.recordings.recording import OUTPUTS, Recording
from identification.replay.batch_simulation import Replay
from identification.replay.model_inputs import model_inputs
from identification.replay.parameter_vector import ParameterVector
from identification.replay.settings import REPLAY, ReplaySettings


def noise_weights(recordings: Sequence[Recording], noise: Mapping[str, float]) -> list[NDArray]:
    """1 / standard deviation per output and sample, (3, samples) [1/SI]; noise: by output [SI]."""
    each = np.array([1.0 / noise[output] for output in OUTPUTS])
    return [np.repeat(each[:, None], len(recording), axis=1) for recording in recordings]


def report_weights(recordings: Sequence[Recording]) -> list[NDArray]:
    """Weights, (3, samples) [1/SI], under which the sum of squares is the squared total error.

    Equations 19 to 21 of the report.
    """
    return [_relative_weights(recording) / np.sqrt(len(recordings)) for recording in recordings]


def measured_outputs(recording: Recording) -> NDArray:
    """OUTPUTS of a recording, (3, samples) [Pa, Pa, A]."""
    return np.stack([recording.channel(output) for output in OUTPUTS])


class WeightedResiduals:
    """Weighted residuals of recordings for scaled parameter vectors."""

    def __init__(
        self,
        recordings: Sequence[Recording],
        vector: ParameterVector,
        weights: Sequence[NDArray],
        settings: ReplaySettings = REPLAY,
    ):
        """Residuals of `recordings`; weights: per recording (3, samples) [1/SI]."""
        self.vector = vector
        self.weights = list(weights)
        self.settings = settings
        self.measured = [measured_outputs(recording) for recording in recordings]
        drives = [model_inputs(recording, vector.reference, settings) for recording in recordings]
        self.replay = Replay(drives, vector.reference, settings)

    def error(self, z: NDArray) -> float:
        """Root of the sum of squares for one scaled vector (k,), without unit.

        Under `report_weights` the total error of equation 21, a fraction.
        """
        return float(np.linalg.norm(np.concatenate(self.residuals(z))))

    def residuals(self, z: NDArray) -> list[NDArray]:
        """Weighted measured - model without nuisances, per recording (3 samples,), without unit."""
        return [residual for residual, _ in self._projected(z, np.zeros((0, len(z))))]

    def linearised(self, z: NDArray) -> tuple[list[NDArray], list[NDArray]]:
        """`residuals`, and their derivatives by z, per recording (3 samples, k), without unit.

        A difference is taken away from the nearer end of a parameter's domain.
        """
        low, high = self.vector.bounds.T
        step = self.settings.relative_step * np.where(z > 0.5 * (low + high), -1.0, 1.0)
        pairs = self._projected(z, np.diag(step))
        return (
            [residual for residual, _ in pairs],
            [changes / step for _, changes in pairs],
        )

    def _projected(self, z: NDArray, steps: NDArray) -> list[tuple[NDArray, NDArray]]:
        """Residual (3 samples,) and its changes (3 samples, m) by the steps (m, k), per recording."""
        candidates = np.vstack([z, z, z + steps])
        shift = np.zeros(len(candidates))
        shift[1] = self.settings.pressure_step
        outputs = self.replay.outputs(self.vector.values(candidates), shift)
        return [
            _without_nuisances(model, measured, weights, self.settings.failed_residual)
            for model, measured, weights in zip(outputs, self.measured, self.weights, strict=True)
        ]


def _without_nuisances(
    model: NDArray, measured: NDArray, weights: NDArray, failed: float
) -> tuple[NDArray, NDArray]:
    """Residual and changes without their share along the nuisances.

    model: (3, samples, 2 + m): candidate, the same with p2 shifted at the start, and m steps. failed:
    residual of samples that the model lacks.
    """
    weighted = (weights[:, :, None] * model).reshape(measured.size, -1)
    residual = np.nan_to_num((weights * measured).ravel() - weighted[:, 0], nan=failed)
    nuisances = np.zeros((*measured.shape, 3))
    nuisances[..., 0] = (weighted[:, 1] - weighted[:, 0]).reshape(measured.shape)
    for column, output in ((1, "p3"), (2, "I")):
        nuisances[OUTPUTS.index(output), :, column] = weights[OUTPUTS.index(output)]
    basis = np.linalg.qr(np.nan_to_num(nuisances.reshape(measured.size, 3)))[0]
    both = np.column_stack([residual, np.nan_to_num(weighted[:, :1] - weighted[:, 2:])])
    both -= basis @ (basis.T @ both)
    return both[:, 0], both[:, 1:]


def _relative_weights(recording: Recording) -> NDArray:
    """Eq. 19's: root of each sample's share of the time, over the output's time mean, (3, samples)."""
    share = np.full(len(recording), 1.0 / (len(recording) - 1))
    share[[0, -1]] *= 0.5
    measured = measured_outputs(recording)
    return np.sqrt(share) / (measured @ share)[:, None]
