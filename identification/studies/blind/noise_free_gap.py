"""What there is to explain: how far a model stays from the truth without its noise.

The gap is that of docs/explanation/diagnosis.md with noise-free outputs for readings: the root of 1 +
the mean square of (model - truth)/noise over the held-out recordings. Its floor is 1.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, minimize_scalar

from epv_env.plant.channels import SENSORS
from epv_env.plant.parameters import Parameters, table
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.recordings.recording import OUTPUTS, UNITS
from identification.replay.batch_simulation import Replay
from identification.replay.model_inputs import ModelInputs
from identification.replay.parameter_vector import ParameterVector
from identification.studies.blind.settings import DEFAULTS, BlindSettings
from identification.valve_gap.causes import PARAMETER_COMPONENTS


@dataclass(frozen=True, kw_only=True)
class NoiseFreeRecording:
    """One recording without noise."""

    name: str
    """Of its programme."""
    held_out: bool
    """Whether no fit uses the recording."""
    period: float
    """Of the samples [s]."""
    channels: Mapping[str, NDArray]
    """U, p1 and OUTPUTS [SI], (samples,)."""

    @property
    def drive(self) -> ModelInputs:
        """Inputs and start for the model: as a diagnosis takes them, but exact."""
        U = self.channels["U"]
        return ModelInputs(
            period=self.period,
            U=U,
            p1=self.channels["p1"],
            sigma_S=np.zeros_like(U),
            U_start=float(U[0]),
            p2_start=float(self.channels["p2"][0]),
        )


class NoiseFreeComparison:
    """The model compared with noise-free recordings."""

    def __init__(
        self,
        recordings: Sequence[NoiseFreeRecording],
        base: Parameters,
        settings: BlindSettings = DEFAULTS,
    ):
        """base: parameters that a call of `residuals` does not give."""
        self.replay = Replay([recording.drive for recording in recordings], base)
        self.true = [np.stack([r.channels[name] for name in OUTPUTS]) for r in recordings]
        self.weights = [_weights(recording) for recording in recordings]
        self.bias = base["b_p2"]  # the circuit starts at what its sensor reads, less the bias
        self.lost_residual = settings.lost_residual

    def residuals(self, values: Mapping[str, NDArray]) -> list[NDArray]:
        """(model - truth)/noise of n candidates per recording [-], (3 samples, n).

        values: of the candidates by symbol [SI], (n,) each.
        """
        outputs = self.replay.outputs(values, p2_shift=-self.bias)
        return [
            np.nan_to_num(
                (model - true[:, :, None]) * weights[:, :, None], nan=self.lost_residual
            ).reshape(true.size, -1)
            for model, true, weights in zip(outputs, self.true, self.weights, strict=True)
        ]


def noise_deviation(channel: str) -> float:
    """Standard deviation of a reading: the sensor's noise and its rounding [SI]."""
    sensor = SENSORS[channel]
    return float(np.hypot(sensor.noise, sensor.resolution / np.sqrt(12))) * UNITS[channel][1]


def recalibrated_parameters(
    recordings: Sequence[NoiseFreeRecording],
    *,
    with_scatter: bool,
    settings: BlindSettings = DEFAULTS,
) -> Parameters:
    """The four parameters, fitted to the calibration recordings' truth.

    with_scatter: fit the other parameters too, within their scatter from unit to unit.
    """
    others = tuple(PARAMETER_COMPONENTS) if with_scatter else ()
    vector = ParameterVector(CALIBRATED_SYMBOLS + others, Parameters.calibrated())
    fitted = [recording for recording in recordings if not recording.held_out]
    comparison = NoiseFreeComparison(fitted, vector.reference, settings)
    return vector.parameters(_best_fit(comparison, vector, _bounds(vector, settings), settings))


def hypothesis_distance(
    recordings: Sequence[NoiseFreeRecording],
    sizes: Mapping[str, float],
    settings: BlindSettings = DEFAULTS,
) -> float:
    """Distance of the nearest plant with these effects from the truth [noise deviations].

    The root of the sum of squares over all samples of all recordings. Whatever the test, two hypotheses
    at distance d are separated correctly with a probability of at most normal_cdf(d/2) (Neyman and
    Pearson 1933): below 70 % for d below 1. The fit varies the four parameters and the sizes freely, and
    the other parameters within their scatter.

    sizes: of the effects by symbol [SI], where the search begins.
    """
    others = tuple(symbol for symbol in PARAMETER_COMPONENTS if symbol not in sizes)
    symbols = CALIBRATED_SYMBOLS + others + tuple(sizes)
    vector = ParameterVector(symbols, Parameters.calibrated().replace(**sizes))
    free = np.array([symbol in sizes for symbol in symbols])
    size_bounds = [[0.0], [settings.largest_size_ratio]]
    bounds = np.where(free, size_bounds, _bounds(vector, settings))
    comparison = NoiseFreeComparison(recordings, vector.reference, settings)
    z = _best_fit(comparison, vector, bounds, settings, free=free)
    squares = [np.sum(part**2) for part in comparison.residuals(vector.values(z[None]))]
    return float(np.sqrt(sum(squares)))


def held_out_gap(
    recordings: Sequence[NoiseFreeRecording],
    values: Mapping[str, float],
    settings: BlindSettings = DEFAULTS,
) -> float:
    """Gap of a model on the held-out recordings [-], at least 1.

    A winding that heats starts each recording at the temperature that fits best.

    values: parameters that differ from Table 12 by symbol [SI].
    """
    squares, count = 0.0, 0
    for recording in recordings:
        if recording.held_out:
            base = Parameters.calibrated().replace(**values)
            comparison = NoiseFreeComparison([recording], base, settings)
            heats = bool(values.get("h_coil"))
            theta = _best_temperature(comparison, settings) if heats else values.get("theta_coil", 0.0)
            residual = comparison.residuals({"theta_coil": np.array([theta])})[0]
            squares += float(np.sum(residual**2))
            count += residual.size
    return float(np.sqrt(1.0 + squares / count))


def _best_fit(
    comparison: NoiseFreeComparison,
    vector: ParameterVector,
    bounds: NDArray,
    settings: BlindSettings,
    free: NDArray | bool = False,
) -> NDArray:
    """The scaled vector that follows the truth best [-], (k,), within bounds (2, k).

    Parameters that scatter from unit to unit have that scatter as prior, unless they are `free` (k,).
    """
    prior = np.where(_scatters(vector) & ~np.asarray(free), 1.0 / settings.unit_scatter, 0.0)
    step = settings.difference_step

    def residuals(z: NDArray) -> NDArray:
        """Of n candidates (n, k): data and prior [-], (residuals, n)."""
        return np.vstack([*comparison.residuals(vector.values(z)), ((z - 1.0) * prior).T])

    def derivatives(z: NDArray) -> NDArray:
        changed = residuals(np.vstack([z, z + step * np.eye(len(z))]))
        return (changed[:, 1:] - changed[:, :1]) / step

    return least_squares(
        lambda z: residuals(z[None])[:, 0],
        np.ones(len(vector.symbols)),
        jac=derivatives,  # type: ignore[arg-type]
        bounds=bounds,  # type: ignore[arg-type]
        xtol=settings.fit_tolerance,
        ftol=settings.fit_tolerance,
        max_nfev=settings.fit_evaluations,
    ).x


def _scatters(vector: ParameterVector) -> NDArray:
    """Whether each parameter scatters from unit to unit, boolean (k,)."""
    return np.array([symbol in PARAMETER_COMPONENTS for symbol in vector.symbols])


def _bounds(vector: ParameterVector, settings: BlindSettings) -> NDArray:
    """The four within their ranges, the others within a unit's scatter; scaled [-], (2, k)."""
    low, high = vector.bounds.T
    scatters, reach = _scatters(vector), settings.scatter_reach
    return np.array([np.where(scatters, 1.0 - reach, low), np.where(scatters, 1.0 + reach, high)])


def _best_temperature(comparison: NoiseFreeComparison, settings: BlindSettings) -> float:
    """Winding temperature above ambient at the start that fits best [K]."""

    def cost(theta: float) -> float:
        return float(np.sum(comparison.residuals({"theta_coil": np.array([theta])})[0] ** 2))

    bounds = table()["theta_coil"].domain or (0.0, 0.0)
    options = {"xatol": settings.temperature_tolerance}
    found = minimize_scalar(cost, bounds=bounds, method="bounded", options=options)
    return float(found.x)  # type: ignore[attr-defined]


def _weights(recording: NoiseFreeRecording) -> NDArray:
    """1/noise [1/SI], (3, samples); 0 for the current at a switching, where it may jump."""
    samples = len(recording.channels["U"])
    weights = np.repeat([[1.0 / noise_deviation(name)] for name in OUTPUTS], samples, axis=1)
    weights[OUTPUTS.index("I"), np.flatnonzero(np.diff(recording.channels["U"])) + 1] = 0.0
    return weights
