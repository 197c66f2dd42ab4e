"""What there is to explain: how far a model stays from the truth without its noise.

The gap is that of docs/explanation/diagnosis.md with noise-free outputs for readings: the root of 1 +
the mean square of (model - truth)/noise over the held-out recordings. Its floor is 1.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, minimize_scalar

from epv_env.plant.channels import SENSORS
from epv_env.plant.parameters import Parameters, table
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.bench.session import TrueSignals
from identification.blind.truth import NOMINAL, UNIT_SCATTER, UNIT_SCATTER_LIMIT, Trial
from identification.calibration.problem import ParameterVector
from identification.recordings.recording import OUTPUTS, UNITS
from identification.replay.model_inputs import ModelInputs
from identification.replay.replay import Replay
from identification.valve_gap.causes import PARAMETER_COMPONENTS

DIFFERENCE_STEP = 1e-4
"""Relative change of a parameter for a finite difference [-]."""

FIT_TOLERANCE, FIT_EVALUATIONS = 1e-4, 20
"""Relative change of the sum of squares, or of the parameters, at which a fit ends, and its most steps
[-]."""

LOST_RESIDUAL = 1e3
"""Residual of samples that a model does not reach [noise deviations]."""

TEMPERATURE_TOLERANCE = 0.01
"""Tolerance of the fitted winding temperature [K]."""


def explainable_gap(trial: Trial, truths: Sequence[TrueSignals]) -> float:
    """Noise-free gap with all parameters fitted within their scatter [-].

    The trial's causes leave this gap, and no unit of the nominal design explains it; the gap is 1
    without a cause.
    """
    return 1.0 if trial.kind == NOMINAL else held_out_gap(truths, recalibrated_parameters(truths))


def recalibrated_parameters(truths: Sequence[TrueSignals]) -> Parameters:
    """All parameters, fitted to the calibration recordings' truth; most within their scatter."""
    vector = ParameterVector(CALIBRATED_SYMBOLS + tuple(PARAMETER_COMPONENTS), Parameters.calibrated())
    comparison = _Comparison([true for true in truths if not is_held_out(true)], vector.reference)
    scatters = np.array([symbol in PARAMETER_COMPONENTS for symbol in vector.symbols])
    prior = np.where(scatters, 1.0 / UNIT_SCATTER, 0.0)
    (low, high), reach = vector.bounds.T, UNIT_SCATTER_LIMIT * UNIT_SCATTER

    def residuals(z: NDArray) -> NDArray:
        """Of n candidates (n, k): data and prior [-], (residuals, n)."""
        return np.vstack([*comparison.residuals(vector.values(z)), ((z - 1.0) * prior).T])

    def derivatives(z: NDArray) -> NDArray:
        changed = residuals(np.vstack([z, z + DIFFERENCE_STEP * np.eye(len(z))]))
        return (changed[:, 1:] - changed[:, :1]) / DIFFERENCE_STEP

    fit = least_squares(
        lambda z: residuals(z[None])[:, 0],
        np.ones(len(vector.symbols)),
        jac=derivatives,  # type: ignore[arg-type]
        bounds=(np.where(scatters, 1.0 - reach, low), np.where(scatters, 1.0 + reach, high)),
        xtol=FIT_TOLERANCE,
        ftol=FIT_TOLERANCE,
        max_nfev=FIT_EVALUATIONS,
    )
    return vector.parameters(fit.x)


def held_out_gap(truths: Sequence[TrueSignals], values: Mapping[str, float]) -> float:
    """Gap of a model on the held-out recordings [-], at least 1.

    A winding that heats starts each recording at the temperature that fits best.

    values: parameters that differ from Table 12 by symbol [SI].
    """
    squares, count = 0.0, 0
    base = Parameters.calibrated().replace(**values)
    for true in filter(is_held_out, truths):
        comparison = _Comparison([true], base)
        theta = _best_temperature(comparison) if base["h_coil"] else base["theta_coil"]
        residual = comparison.residuals({"theta_coil": np.array([theta])})[0]
        squares += float(np.sum(residual**2))
        count += residual.size
    return float(np.sqrt(1.0 + squares / count))


def is_held_out(true: TrueSignals) -> bool:
    """Whether no fit uses a recording."""
    return true.programme.role == "validation"


def noise_deviation(channel: str) -> float:
    """Standard deviation of a reading: the sensor's noise and its rounding [SI]."""
    sensor = SENSORS[channel]
    return float(np.hypot(sensor.noise, sensor.resolution / np.sqrt(12))) * UNITS[channel][1]


class _Comparison:
    """The model compared with noise-free recordings; base: parameters that `residuals` is not given."""

    def __init__(self, truths: Sequence[TrueSignals], base: Parameters):
        self.replay = Replay([_inputs(true) for true in truths], base)
        self.true = [np.stack([true.channels[name] for name in OUTPUTS]) for true in truths]
        self.weights = [_weights(true) for true in truths]

    def residuals(self, values: Mapping[str, NDArray]) -> list[NDArray]:
        """(model - truth)/noise of n candidates per recording [-], (3 samples, n)."""
        outputs = self.replay.outputs(values)
        return [
            np.nan_to_num((model - true[:, :, None]) * weights[:, :, None], nan=LOST_RESIDUAL).reshape(
                true.size, -1
            )
            for model, true, weights in zip(outputs, self.true, self.weights, strict=True)
        ]


def _inputs(true: TrueSignals) -> ModelInputs:
    """Inputs and start for the model: as a diagnosis takes them, but exact."""
    U = true.channels["U"]
    return ModelInputs(
        period=true.period,
        U=U,
        p1=true.channels["p1"],
        sigma_S=np.zeros_like(U),
        U_start=float(U[0]),
        p2_start=float(true.channels["p2"][0]),
    )


def _weights(true: TrueSignals) -> NDArray:
    """1/noise [1/SI], (3, samples); 0 for the current at a switching, where it may jump."""
    U = true.channels["U"]
    weights = np.repeat([[1.0 / noise_deviation(name)] for name in OUTPUTS], len(U), axis=1)
    weights[OUTPUTS.index("I"), np.flatnonzero(np.diff(U)) + 1] = 0.0
    return weights


def _best_temperature(comparison: _Comparison) -> float:
    """Winding temperature above ambient at the start that fits best [K]."""

    def cost(theta: float) -> float:
        return float(np.sum(comparison.residuals({"theta_coil": np.array([theta])})[0] ** 2))

    bounds = table()["theta_coil"].domain or (0.0, 0.0)
    options = {"xatol": TEMPERATURE_TOLERANCE}
    found = minimize_scalar(cost, bounds=bounds, method="bounded", options=options)
    return float(found.x)  # type: ignore[attr-defined]
