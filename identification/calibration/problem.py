"""What a calibration is about: recordings, the parameters that may move, and the model's misfit.

Two weightings of the misfit: by the measured noise (least squares), and that of the report's total
error, whose square (eqs 19-21) is a weighted sum of squares too. What a recording does not tell of
itself exactly - its circuit pressure at the start, the zero of the p3 and I sensors on that day - is a
nuisance. The outputs are as good as linear in these few numbers, which are solved for at every candidate
(variable projection, Golub & Pereyra 1973), so the optimiser sees the parameters alone.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.free_parameters import FREE_PARAMETERS, Freedom, check_free
from epv_env.plant.parameters import Parameters
from identification.quality.assessment import SensorOffset, assess_recording, sensor_offsets
from identification.recordings.noise import campaign_noise, campaign_steps
from identification.recordings.recording import OUTPUTS, Campaign, CampaignError, Recording
from identification.replay.model_inputs import model_inputs, without_offsets
from identification.replay.replay import P2_SHIFT, Replay, measured_outputs


@dataclass(frozen=True)
class ParameterVector:
    """Fitted symbols in order; an optimiser sees each divided by its reference value."""

    symbols: tuple[str, ...]
    reference: Parameters
    """Scales of the symbols, and the values of all parameters that are not fitted."""
    freedoms: Mapping[str, Freedom] = field(default_factory=dict)
    """Bounds and prior knowledge by symbol; a symbol without has its domain, and nothing is known."""

    @property
    def scale(self) -> NDArray:
        """Reference values [SI], (k,)."""
        return np.array([self.reference[symbol] for symbol in self.symbols])

    @property
    def domains(self) -> NDArray:
        """Least and greatest values: given bounds, else the ends of the domains [SI], (k, 2)."""
        return np.array([self._freedom(s).bounds or self.reference.domain(s) for s in self.symbols])

    @property
    def bounds(self) -> NDArray:
        """Scaled ends of the domains, the lesser first, (k, 2), without unit."""
        return np.sort(self.domains / self.scale[:, None], axis=1)

    def _freedom(self, symbol: str) -> Freedom:
        return self.freedoms.get(symbol, Freedom())

    def prior(self, z: NDArray) -> tuple[NDArray, NDArray]:
        """What is known before of a scaled vector z (k,): residuals (p,) and derivatives (p, k).

        One for each of the p symbols with a mean: the departure from it in standard deviations.
        """
        known = [(i, self._freedom(s)) for i, s in enumerate(self.symbols)]
        rows = [(i, f.mean, f.sd) for i, f in known if f.mean is not None and f.sd is not None]
        residuals = np.array([(mean - self.scale[i] * z[i]) / sd for i, mean, sd in rows])
        slopes = np.zeros((len(rows), len(z)))
        for row, (i, _, sd) in enumerate(rows):
            slopes[row, i] = -self.scale[i] / sd
        return residuals, slopes

    def known(self) -> dict[str, tuple[float | None, float | None]]:
        """Mean and standard deviation of what is known before, by symbol [SI], ready for JSON."""
        freedoms = {symbol: self._freedom(symbol) for symbol in self.symbols}
        return {s: (f.mean, f.sd) for s, f in freedoms.items() if f.mean is not None}

    def values(self, z: NDArray) -> dict[str, NDArray]:
        """Values by symbol [SI], each of shape (n,), for scaled vectors z (n, k)."""
        return dict(zip(self.symbols, np.moveaxis(np.atleast_2d(z) * self.scale, 1, 0), strict=True))

    def parameters(self, z: NDArray) -> Parameters:
        """The complete set [SI] for one scaled vector (k,), within the domains."""
        inside = np.clip(z * self.scale, *self.domains.T)
        return self.reference.replace(**dict(zip(self.symbols, inside.tolist(), strict=True)))

    def scaled(self, parameters: Mapping[str, float]) -> NDArray:
        """The scaled vector (k,), without unit, of a set of parameters [SI]."""
        return np.array([parameters[symbol] for symbol in self.symbols]) / self.scale


class WeightedResiduals:
    """Weighted residuals of recordings for scaled parameter vectors."""

    def __init__(
        self,
        recordings: Sequence[Recording],
        vector: ParameterVector,
        weights: Sequence[NDArray],
    ):
        """Residuals of `recordings`; weights: per recording (3, samples) [1/SI]."""
        self.vector = vector
        self.weights = list(weights)
        self.measured = [measured_outputs(recording) for recording in recordings]
        drives = [model_inputs(recording, vector.reference) for recording in recordings]
        self.replay = Replay(drives, vector.reference)

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
        step = 1e-4 * np.where(z > 0.5 * (low + high), -1.0, 1.0)
        pairs = self._projected(z, np.diag(step))
        return (
            [residual for residual, _ in pairs],
            [changes / step for _, changes in pairs],
        )

    def _projected(self, z: NDArray, steps: NDArray) -> list[tuple[NDArray, NDArray]]:
        """Residual (3 samples,) and its changes (3 samples, m) by the steps (m, k), per recording."""
        candidates = np.vstack([z, z, z + steps])
        shift = np.zeros(len(candidates))
        shift[1] = 1e3  # Pa, by which the influence of the start is measured
        outputs = self.replay.outputs({**self.vector.values(candidates), P2_SHIFT: shift})
        return [
            _without_nuisances(model, measured, weights)
            for model, measured, weights in zip(outputs, self.measured, self.weights, strict=True)
        ]


def _without_nuisances(model: NDArray, measured: NDArray, weights: NDArray) -> tuple[NDArray, NDArray]:
    """Residual and changes without their share along the nuisances.

    model: (3, samples, 2 + m): candidate, the same with p2 shifted at the start, and m steps.
    """
    weighted = (weights[:, :, None] * model).reshape(measured.size, -1)
    # A candidate that cannot be integrated is far off.
    residual = np.nan_to_num((weights * measured).ravel() - weighted[:, 0], nan=1e3)
    nuisances = np.zeros((*measured.shape, 3))
    nuisances[..., 0] = (weighted[:, 1] - weighted[:, 0]).reshape(measured.shape)
    for column, output in ((1, "p3"), (2, "I")):
        nuisances[OUTPUTS.index(output), :, column] = weights[OUTPUTS.index(output)]
    basis = np.linalg.qr(np.nan_to_num(nuisances.reshape(measured.size, 3)))[0]
    both = np.column_stack([residual, np.nan_to_num(weighted[:, :1] - weighted[:, 2:])])
    both -= basis @ (basis.T @ both)
    return both[:, 0], both[:, 1:]


def noise_weights(recordings: Sequence[Recording], noise: Mapping[str, float]) -> list[NDArray]:
    """1 / standard deviation per output and sample, (3, samples) [1/SI]; noise: by output [SI]."""
    each = np.array([1.0 / noise[output] for output in OUTPUTS])
    return [np.repeat(each[:, None], len(recording), axis=1) for recording in recordings]


def report_weights(recordings: Sequence[Recording]) -> list[NDArray]:
    """Weights, (3, samples) [1/SI], under which the sum of squares is the squared total error.

    Equations 19 to 21 of the report: root of each sample's share of the time, over the output's time
    mean and the root of the number of recordings.
    """
    weights = []
    for recording in recordings:
        share = np.full(len(recording), 1.0 / (len(recording) - 1))
        share[[0, -1]] *= 0.5
        means = measured_outputs(recording) @ share
        weights.append(np.sqrt(share) / means[:, None] / np.sqrt(len(recordings)))
    return weights


@dataclass(frozen=True, kw_only=True)
class CalibrationProblem:
    """Recordings free of their sensors' offsets, and a vector of parameters to fit to them."""

    calibration: tuple[Recording, ...]
    validation: tuple[Recording, ...]
    noise: Mapping[str, float]
    """Standard deviation of each channel's noise [SI units]."""
    offsets: Mapping[str, SensorOffset]
    """What was subtracted from each channel; empty without a record at rest."""
    steps: Mapping[str, float]
    """Coarse steps of the readings by channel [SI]; empty on a bench whose noise moves every reading."""
    vector: ParameterVector
    """Its reference is where the calibration starts."""

    def least_squares(self) -> WeightedResiduals:
        """The calibration recordings' misfit in units of their noise."""
        return WeightedResiduals(
            self.calibration, self.vector, noise_weights(self.calibration, self.noise)
        )

    def total_error(self) -> WeightedResiduals:
        """The calibration recordings' misfit by the report's total error (eqs 19-21)."""
        return WeightedResiduals(self.calibration, self.vector, report_weights(self.calibration))


def calibration_problem(
    campaign: Campaign,
    *,
    start: Parameters | None = None,
    free: Mapping[str, Freedom] = FREE_PARAMETERS,
) -> CalibrationProblem:
    """The problem that a campaign poses, from `start` (None: Table 10) at the campaign's ambient.

    free: which parameters may move, and how far.

    Raises CampaignError if there is no recording to fit to; ParameterError for parameters that
    cannot be fitted, or ambient conditions outside the plant's domain.
    """
    if not campaign.with_role("calibration"):
        raise CampaignError(
            f"campaign {campaign.name!r} has no recording with role 'calibration': give at least one"
        )
    start = (start or Parameters.initial_guess()).replace(
        T_env=campaign.temperature, p_env=campaign.pressure
    )
    check_free(free, start)
    steps = campaign_steps(campaign.recordings, campaign.rules)
    offsets = _offsets(campaign, steps)
    values = {name: offset.value for name, offset in offsets.items()}
    return CalibrationProblem(
        calibration=tuple(without_offsets(r, values) for r in campaign.with_role("calibration")),
        validation=tuple(without_offsets(r, values) for r in campaign.with_role("validation")),
        noise=campaign_noise(campaign),
        offsets=offsets,
        steps=steps,
        vector=ParameterVector(symbols=tuple(free), reference=start, freedoms=free),
    )


def _offsets(campaign: Campaign, steps: Mapping[str, float]) -> dict[str, SensorOffset]:
    """The sensors' offsets from the first quality recording that shows them."""
    for recording in campaign.with_role("quality"):
        assessed = assess_recording(
            recording, campaign.pressure, steps=steps, sensors=campaign.rules.sensors
        )
        offsets = sensor_offsets(assessed)
        if offsets:
            return offsets
    return {}
