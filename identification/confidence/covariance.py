"""Covariance of an estimate that holds for sampled, autocorrelated residuals.

An estimate that minimises a weighted sum of squares moves with the noise e of the outputs by H J'We,
H = (J'W'WJ)^-1. The usual covariance s^2 H assumes independent e of the weights' size; here the middle
of the sandwich H M H sums what neighbouring samples have in common (Newey & West 1987). The inputs
that the model takes as known (U, p1) carry noise too, of which the residuals show nothing: its share is
found by drawing that noise anew. What is known of the parameters before adds its
information to J'W'WJ and, as one more reading each, to M.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from statsmodels.stats.sandwich_covariance import S_hac_simple
from statsmodels.tsa.stattools import acf

from identification.calibration.problem import CalibrationProblem, WeightedResiduals
from identification.recordings.recording import OUTPUTS, Recording
from identification.replay.model_inputs import ModelInputs, model_inputs
from identification.replay.replay import Replay

INPUT_DRAWS = 8
"""Times that the noise of the inputs is drawn anew for each recording."""

INPUTS = ("U", "p1")
"""Channels that the model takes as known."""


@dataclass(frozen=True, kw_only=True)
class EstimateCovariance:
    """Covariances (k, k) of a scaled vector, without unit."""

    independent: NDArray
    """As if the residuals were independent: s^2 H."""
    residual: NDArray
    """Sandwich: from the residuals as they are."""
    inputs: NDArray
    """From the noise of the inputs, and from what is left of the sensors' offsets."""
    lags: int
    """Samples over which the sandwich sums."""

    @property
    def total(self) -> NDArray:
        """Sum of residual and inputs, (k, k), without unit; the joint region rests on this sum."""
        return self.residual + self.inputs


def estimate_covariance(
    problem: CalibrationProblem,
    misfit: WeightedResiduals,
    z: NDArray,
    *,
    seed: int = 0,
) -> EstimateCovariance:
    """Covariance of an estimate that minimises one of the problem's weighted residuals.

    z: the estimate, scaled (k,), without unit. seed: of the noise drawn for the inputs.
    """
    residuals, jacobians = misfit.linearised(z)
    slopes = problem.vector.prior(z)[1]
    known = slopes.T @ slopes
    H = np.linalg.inv(sum(J.T @ J for J in jacobians) + known)
    samples = sum(len(residual) for residual in residuals)
    variance = sum(float(r @ r) for r in residuals) / (samples - len(z))
    lags = max(correlation_lags(residual) for residual in residuals)
    middle = sum(S_hac_simple(s, nlags=lags) for s in score_series(residuals, jacobians))
    influence = [H @ J.T for J in jacobians]
    inputs = _input_share(problem, misfit, z, influence, seed)
    return EstimateCovariance(
        independent=variance * H,
        residual=H @ (middle + known) @ H,
        inputs=inputs + _offset_share(problem, misfit, z, influence),
        lags=lags,
    )


def score_series(residuals: Sequence[NDArray], jacobians: Sequence[NDArray]) -> list[NDArray]:
    """J'e of each instant, summed over the outputs; per recording (samples, k), without unit.

    residuals: weighted, per recording (3 samples,). jacobians: by the scaled parameters, per recording
    (3 samples, k).
    """
    return [
        (J * r[:, None]).reshape(len(OUTPUTS), -1, J.shape[1]).sum(axis=0)
        for r, J in zip(residuals, jacobians, strict=True)
    ]


def correlation_lags(residual: NDArray) -> int:
    """Lags [samples] over which neighbours in one recording's residual (3 samples,) may correlate.

    Twice the first lag at which every output's autocorrelation is within its 95 % band, and at least
    Newey and West's rule of thumb 4 (n/100)^(2/9).
    """
    outputs = residual.reshape(len(OUTPUTS), -1)
    n = outputs.shape[1]
    longest = n // 10
    band = 1.96 / np.sqrt(n)
    correlations = np.array([acf(output, nlags=longest, fft=True) for output in outputs])
    within = np.all(np.abs(correlations) < band, axis=0)
    first = int(np.argmax(within)) if np.any(within) else longest
    return min(max(2 * first, int(4 * (n / 100) ** (2 / 9))), longest)


def _input_share(
    problem: CalibrationProblem,
    misfit: WeightedResiduals,
    z: NDArray,
    influence: Sequence[NDArray],
    seed: int,
) -> NDArray:
    """Mean square of how far redrawn input noise moves the estimate, summed over the recordings.

    influence: H J' per recording (k, 3 samples).
    """
    redrawn = _redrawn(problem, misfit.replay.drives, np.random.default_rng(seed))
    values = misfit.vector.values(z)
    known = misfit.replay.outputs(values)
    noisy = Replay(redrawn, misfit.vector.reference).outputs(values)
    share = np.zeros((len(z), len(z)))
    for r, (influenced, weights) in enumerate(zip(influence, misfit.weights, strict=True)):
        for model in noisy[r * INPUT_DRAWS : (r + 1) * INPUT_DRAWS]:
            moved = influenced @ (weights * (model - known[r])[:, :, 0]).ravel()
            share += np.outer(moved, moved) / INPUT_DRAWS
    return share


def _offset_share(
    problem: CalibrationProblem, misfit: WeightedResiduals, z: NDArray, influence: Sequence[NDArray]
) -> NDArray:
    """How far the standard errors of the offsets, common to all recordings, move the estimate.

    Those of p3 and I do not count: they are nuisances of each recording.
    """
    values = misfit.vector.values(z)
    known = misfit.replay.outputs(values)
    share = np.zeros((len(z), len(z)))
    for channel in (name for name in ("U", "p1", "p2") if name in problem.offsets):
        error = problem.offsets[channel].error
        drives = [_shifted(drive, channel, error) for drive in misfit.replay.drives]
        models = Replay(drives, misfit.vector.reference).outputs(values)
        moved = np.zeros(len(z))
        for influenced, weights, model, before in zip(
            influence, misfit.weights, models, known, strict=True
        ):
            change = (before - model)[:, :, 0]
            if channel in OUTPUTS:  # the reading is shifted with it
                change[OUTPUTS.index(channel)] += error
            moved += influenced @ (weights * change).ravel()
        share += np.outer(moved, moved)
    return share


def _shifted(drive: ModelInputs, channel: str, error: float) -> ModelInputs:
    """The drive that would follow if a channel read higher by `error` [SI units]."""
    if channel == "U":
        return replace(drive, U=drive.U + error, U_start=drive.U_start + error)
    if channel == "p1":
        return replace(drive, p1=drive.p1 + error)
    return replace(drive, p2_start=drive.p2_start + error)


def _redrawn(
    problem: CalibrationProblem, drives: Sequence[ModelInputs], rng: np.random.Generator
) -> list[ModelInputs]:
    """INPUT_DRAWS inputs per recording, as they would follow from other noise on the same inputs.

    The circuit pressure at the start, which is a nuisance, stays.
    """
    return [
        replace(
            model_inputs(_noisy(recording, drive, problem.noise, rng), problem.vector.reference),
            p2_start=drive.p2_start,
        )
        for recording, drive in zip(problem.calibration, drives, strict=True)
        for _ in range(INPUT_DRAWS)
    ]


def _noisy(
    recording: Recording, drive: ModelInputs, noise: Mapping[str, float], rng: np.random.Generator
) -> Recording:
    drawn = {
        name: getattr(drive, name) + noise[name] * rng.standard_normal(len(recording)) for name in INPUTS
    }
    return replace(recording, **drawn)
