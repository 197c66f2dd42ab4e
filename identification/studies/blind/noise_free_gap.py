"""What there is to explain: how far a model stays from the truth without its noise.

The gap is that of docs/gap.md, with the noise-free outputs in the place of the readings: the root of
1 + the mean square of (model - truth)/noise over the held-out recordings. So 1 is the floor.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, minimize_scalar

from epv_env.plant.parameters import Parameters, table
from epv_env.plant.region import CALIBRATED_SYMBOLS
from epv_env.plant.sensors import SENSORS
from identification.recordings.recording import OUTPUTS, UNITS
from identification.replay.batch_simulation import Replay
from identification.replay.model_inputs import ModelInputs
from identification.replay.parameter_vector import ParameterVector
from identification.studies.blind.truth import FARTHEST, SCATTER
from identification.valve_gap.causes import PARAMETER_COMPONENTS

STEP = 1e-4
"""Relative change of a parameter for a finite difference."""

PRECISION = 1e-4
"""Relative change of the sum of squares, or of the parameters, at which a fit has converged."""

MOST_STEPS = 20

LARGER = 3.0
"""How many times larger than where the search begins a size may be."""

LOST = 1e3
"""Residual of samples that a model does not reach [noise deviations]."""


@dataclass(frozen=True, kw_only=True)
class NoiseFree:
    """One recording without noise; arrays (samples,), SI units."""

    name: str
    held_out: bool
    period: float
    channels: Mapping[str, NDArray]
    """U, p1 and OUTPUTS."""

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


class Outputs:
    """The model beside noise-free recordings."""

    def __init__(self, recordings: Sequence[NoiseFree], base: Parameters):
        """base: every parameter that a call does not give."""
        self.replay = Replay([recording.drive for recording in recordings], base)
        self.true = [np.stack([r.channels[name] for name in OUTPUTS]) for r in recordings]
        self.weights = [_weights(recording) for recording in recordings]
        self.bias = base["b_p2"]  # the circuit starts at what its sensor reads, less the bias

    def residuals(self, values: Mapping[str, NDArray]) -> list[NDArray]:
        """(model - truth)/noise per recording, (3 samples, n), for n candidates by symbol."""
        found = self.replay.outputs(values, p2_shift=-self.bias)
        return [
            np.nan_to_num((model - true[:, :, None]) * weights[:, :, None], nan=LOST).reshape(
                true.size, -1
            )
            for model, true, weights in zip(found, self.true, self.weights, strict=True)
        ]


def noise(channel: str) -> float:
    """Standard deviation of a reading: the sensor's noise and its rounding [SI]."""
    sensor = SENSORS[channel]
    return float(np.hypot(sensor.noise, sensor.resolution / np.sqrt(12))) * UNITS[channel][1]


def recalibrated(recordings: Sequence[NoiseFree], *, scattered: bool) -> Parameters:
    """The four parameters, as well as they can follow the calibration recordings' truth.

    scattered: whether the others may give way, as far as they scatter from unit to unit.
    """
    others = tuple(PARAMETER_COMPONENTS) if scattered else ()
    vector = ParameterVector(CALIBRATED_SYMBOLS + others, Parameters.calibrated())
    outputs = Outputs([r for r in recordings if not r.held_out], vector.reference)
    return vector.parameters(_nearest(outputs, vector, _bounds(vector)))


def distance(recordings: Sequence[NoiseFree], sizes: Mapping[str, float]) -> float:
    """How far the nearest plant with these effects stays from the truth, in noise deviations.

    The root of the sum of squares over all samples of all recordings: two hypotheses d apart are told
    from each other rightly by at most a share normal_cdf(d/2) of whatever tests (Neyman and Pearson), so
    below 1 in less than 70 % of the cases. The four parameters and the sizes are free, the others give
    way as far as they scatter. sizes: by symbol, where the search begins.
    """
    others = tuple(symbol for symbol in PARAMETER_COMPONENTS if symbol not in sizes)
    symbols = CALIBRATED_SYMBOLS + others + tuple(sizes)
    vector = ParameterVector(symbols, Parameters.calibrated().replace(**sizes))
    bounds = _bounds(vector)
    own = np.array([symbol in sizes for symbol in symbols])
    outputs = Outputs(recordings, vector.reference)
    z = _nearest(outputs, vector, np.where(own, [[0.0], [LARGER]], bounds), free=own)
    squares = [np.sum(part**2) for part in outputs.residuals(vector.values(z[None]))]
    return float(np.sqrt(sum(squares)))


def _nearest(
    outputs: Outputs, vector: ParameterVector, bounds: NDArray, free: NDArray | bool = False
) -> NDArray:
    """The scaled vector (k,) that follows the truth best, within bounds (2, k).

    What scatters from unit to unit is held by its prior, unless it is `free` (k,).
    """
    scatters = np.array([symbol in PARAMETER_COMPONENTS for symbol in vector.symbols])
    prior = np.where(scatters & ~np.asarray(free), 1.0 / SCATTER, 0.0)

    def residuals(z: NDArray) -> NDArray:
        """Of candidates (n, k): data and prior, (residuals, n)."""
        return np.vstack([*outputs.residuals(vector.values(z)), ((z - 1.0) * prior).T])

    def derivatives(z: NDArray) -> NDArray:
        changed = residuals(np.vstack([z, z + STEP * np.eye(len(z))]))
        return (changed[:, 1:] - changed[:, :1]) / STEP

    found = least_squares(
        lambda z: residuals(z[None])[:, 0],
        np.ones(len(vector.symbols)),
        jac=derivatives,  # type: ignore[arg-type]
        bounds=bounds,  # type: ignore[arg-type]
        xtol=PRECISION,
        ftol=PRECISION,
        max_nfev=MOST_STEPS,
    )
    return found.x


def held_out_gap(recordings: Sequence[NoiseFree], values: Mapping[str, float]) -> float:
    """Gap of a model on the held-out recordings; values: its parameters that are not Table 12's.

    A winding that heats is as warm at the start of each as fits it best.
    """
    squares, count = 0.0, 0
    for recording in recordings:
        if recording.held_out:
            outputs = Outputs([recording], Parameters.calibrated().replace(**values))
            warmth = _warmth(outputs) if values.get("h_coil") else values.get("theta_coil", 0.0)
            residual = outputs.residuals({"theta_coil": np.array([warmth])})[0]
            squares += float(np.sum(residual**2))
            count += residual.size
    return float(np.sqrt(1.0 + squares / count))


def _bounds(vector: ParameterVector) -> NDArray:
    """The four within their domains, the others as far as a unit's scatter goes; scaled, (2, k)."""
    low, high = vector.bounds.T
    scatters = np.array([symbol in PARAMETER_COMPONENTS for symbol in vector.symbols])
    reach = FARTHEST * SCATTER
    return np.array([np.where(scatters, 1.0 - reach, low), np.where(scatters, 1.0 + reach, high)])


def _warmth(outputs: Outputs) -> float:
    low, high = table()["theta_coil"].domain or (0.0, 0.0)
    found = minimize_scalar(
        lambda theta: float(np.sum(outputs.residuals({"theta_coil": np.array([theta])})[0] ** 2)),
        bounds=(low, high),
        method="bounded",
        options={"xatol": 0.01},
    )
    return float(found.x)  # type: ignore[attr-defined]


def _weights(recording: NoiseFree) -> NDArray:
    """1/noise, (3, samples); 0 for the current at a switching, which may jump there."""
    weights = np.repeat([[1.0 / noise(name)] for name in OUTPUTS], len(recording.channels["U"]), axis=1)
    weights[OUTPUTS.index("I"), np.flatnonzero(np.diff(recording.channels["U"])) + 1] = 0.0
    return weights
