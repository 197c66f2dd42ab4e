"""What there is to explain: how far a model stays from the truth without its noise.

The gap is that of docs/explanation/diagnosis.md with noise-free outputs for readings: the root of 1 +
the mean square of (model - truth)/noise over the held-out recordings. Its floor is 1.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, minimize_scalar

from docs.studies.blind.truth import NOMINAL, UNIT_SCATTER, UNIT_SCATTER_LIMIT, Trial
from epv_env.plant.channels import SENSORS
from epv_env.plant.free_parameters import Freedom
from epv_env.plant.parameters import Parameters, table
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.bench.session import TrueSignals
from identification.calibration.problem import ParameterVector
from identification.recordings.recording import OUTPUTS, UNITS
from identification.replay.model_inputs import ModelInputs
from identification.replay.replay import Replay
from identification.valve_gap.causes import PARAMETER_COMPONENTS

DIFFERENCE_STEP = 1e-4
"""Relative change of a parameter for a finite difference [-]."""


def explainable_gap(trial: Trial, truths: Sequence[TrueSignals]) -> float:
    """Noise-free gap with all parameters fitted within their scatter [-].

    The trial's causes leave this gap, and no unit of the nominal design explains it; the gap is 1
    without a cause.
    """
    return 1.0 if trial.kind == NOMINAL else held_out_gap(truths, recalibrated_parameters(truths))


def recalibrated_parameters(truths: Sequence[TrueSignals]) -> Parameters:
    """All parameters, fitted to the calibration recordings' truth; most within their scatter."""
    base, limit = Parameters.calibrated(), UNIT_SCATTER_LIMIT * UNIT_SCATTER
    scatter = {
        s: Freedom(bounds=(base[s] * (1.0 - limit), base[s] * (1.0 + limit)))
        for s in PARAMETER_COMPONENTS
    }
    vector = ParameterVector((*CALIBRATED_SYMBOLS, *scatter), base, scatter)
    comparison = _Comparison([true for true in truths if not is_held_out(true)], base)
    first, unit = len(CALIBRATED_SYMBOLS), np.eye(len(vector.symbols))

    def residuals(z: NDArray) -> NDArray:
        """Of the outputs at scaled vectors (n, k), (values, n)."""
        return comparison.residuals(dict(zip(vector.symbols, (z * vector.scale).T, strict=True)))

    def derivatives(z: NDArray) -> NDArray:
        found = residuals(z + DIFFERENCE_STEP * np.vstack([0.0 * z, unit]))
        slopes = (found[:, 1:] - found[:, :1]) / DIFFERENCE_STEP
        return np.vstack([slopes, -unit[first:] / UNIT_SCATTER])

    fit = least_squares(
        lambda z: np.append(residuals(z[None])[:, 0], (1.0 - z[first:]) / UNIT_SCATTER),
        np.ones(len(vector.symbols)),
        jac=derivatives,  # type: ignore[arg-type]
        bounds=vector.bounds.T,
        xtol=1e-4,
        ftol=1e-4,
        max_nfev=20,
    )
    return vector.parameters(fit.x)


def held_out_gap(truths: Sequence[TrueSignals], values: Mapping[str, float]) -> float:
    """Gap of a model on the held-out recordings [-], at least 1.

    A winding that heats starts each recording at the temperature that fits best. values: parameters that
    differ from Table 12 by symbol [SI].
    """
    base, squares = Parameters.calibrated().replace(**values), []
    for true in filter(is_held_out, truths):
        comparison = _Comparison([true], base)
        theta = _best_temperature(comparison) if base["h_coil"] else base["theta_coil"]
        squares.append(comparison.squares(theta))
    return float(np.sqrt(1.0 + np.mean(np.concatenate(squares))))


def is_held_out(true: TrueSignals) -> bool:
    """Whether no fit uses a recording."""
    return true.programme.role == "validation"


class _Comparison:
    """The model compared with noise-free recordings; base: parameters that `residuals` is not given."""

    def __init__(self, truths: Sequence[TrueSignals], base: Parameters):
        self.replay = Replay([_inputs(true.channels, true.period) for true in truths], base)
        self.true = [np.stack([true.channels[name] for name in OUTPUTS]) for true in truths]
        self.weights = [_weights(true) for true in truths]

    def residuals(self, values: Mapping[str, NDArray]) -> NDArray:
        """(model - truth)/noise of n candidates [-], (3 samples of all recordings, n)."""
        each = [
            ((model - true[:, :, None]) * weights[:, :, None]).reshape(true.size, -1)
            for model, true, weights in zip(
                self.replay.outputs(values), self.true, self.weights, strict=True
            )
        ]
        return np.nan_to_num(np.vstack(each), nan=1e3)  # a model that fails is far off

    def squares(self, theta: float) -> NDArray:
        """Squared residuals (residuals,) where the windings start at a temperature [K above ambient]."""
        return self.residuals({"theta_coil": np.array([theta])})[:, 0] ** 2


def _inputs(channels: Mapping[str, NDArray], period: float) -> ModelInputs:
    """Inputs and start for the model: as a diagnosis takes them, but exact."""
    U, p1, p2 = channels["U"], channels["p1"], channels["p2"]
    still = np.zeros_like(U)
    return ModelInputs(
        period=period, U=U, p1=p1, sigma_S=still, U_start=float(U[0]), p2_start=float(p2[0])
    )


def _weights(true: TrueSignals) -> NDArray:
    """1/noise [1/SI], (3, samples); 0 for the current at a switching, where it may jump.

    The noise is the sensor's and that of its rounding.
    """
    U = true.channels["U"]
    weights = np.empty((len(OUTPUTS), len(U)))
    for row, name in zip(weights, OUTPUTS, strict=True):
        sensor = SENSORS[name]
        row[:] = 1.0 / (np.hypot(sensor.noise, sensor.resolution / np.sqrt(12)) * UNITS[name][1])
    weights[OUTPUTS.index("I"), np.flatnonzero(np.diff(U)) + 1] = 0.0
    return weights


def _best_temperature(comparison: _Comparison) -> float:
    """Winding temperature above ambient at the start that fits best [K]."""
    found = minimize_scalar(
        lambda theta: float(np.sum(comparison.squares(theta))),
        bounds=table()["theta_coil"].domain or (0.0, 0.0),
        method="bounded",
        options={"xatol": 0.01},
    )
    return float(found.x)  # type: ignore[attr-defined]
