"""The error tables that a valve with a cause would have given: Tables 11, 13 and 15 predicted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from epv_env.plant.channels import SENSORS
from epv_env.plant.parameters import Parameters
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.recordings.recording import OUTPUTS, UNITS
from identification.replay.batch_simulation import Replay
from identification.replay.model_inputs import ModelInputs
from identification.report_2003.printed_values import printed_errors
from identification.studies.error_tables.bench_conditions import N_FITTED, Conditions
from identification.studies.error_tables.recalibration import (
    calibrated_vector,
    recalibrated,
    relative_weights,
    start_shift,
)
from identification.studies.error_tables.settings import DEFAULTS, ErrorTableSettings


@dataclass(frozen=True, kw_only=True)
class HypotheticalValve:
    """A valve that may have stood on the real bench, with its current measurement."""

    values: Mapping[str, Sequence[float]]
    """Values that differ from Table 12 by symbol, one per test [SI]."""
    current_lag: float = 0.0
    """Time constant of the current's measurement [s]."""


@dataclass(frozen=True, kw_only=True)
class PredictedErrors:
    """Errors of n valves, and where their recalibrated parameters end."""

    calibrated: NDArray
    """Tables 13 and 15 [%], (n, 5 tests, 3 outputs); infinite where a valve cannot be integrated."""
    initial: NDArray
    """Table 11 [%], (n, 4 tests, 3 outputs): the model differs from its optimum as Table 10 differs from
    Table 12."""
    z: NDArray
    """Recalibrated parameters relative to Table 12 [-], (n, 4)."""


def printed_calibrated_errors() -> NDArray:
    """Tables 13 and 15 [%], (5 tests, 3 outputs)."""
    return _printed_cells(13, 15)


def printed_initial_errors() -> NDArray:
    """Table 11 [%], (4 tests, 3 outputs)."""
    return _printed_cells(11)


def predicted_errors(
    conditions: Conditions,
    valves: Sequence[HypotheticalValve],
    settings: ErrorTableSettings = DEFAULTS,
) -> PredictedErrors:
    """Predicted tables of n valves under the same conditions."""
    block = settings.valves_at_once
    parts = [
        _predicted_block(conditions, valves[first : first + block], settings)
        for first in range(0, len(valves), block)
    ]
    return PredictedErrors(
        calibrated=np.concatenate([part.calibrated for part in parts]),
        initial=np.concatenate([part.initial for part in parts]),
        z=np.concatenate([part.z for part in parts]),
    )


def initial_guess_ratio() -> NDArray:
    """The four parameters of Table 10 over those of Table 12 [-], (4,)."""
    guess, calibrated = Parameters.initial_guess(), Parameters.calibrated()
    return np.array([guess[symbol] / calibrated[symbol] for symbol in CALIBRATED_SYMBOLS])


def lagged(signal: NDArray, time_constant: float, period: float) -> NDArray:
    """A signal behind a first-order filter that starts in steady state, in its unit, (samples,).

    Args:
        signal: (samples,).
        time_constant: of the filter [s].
        period: of the samples [s].
    """
    kept = np.exp(-period / time_constant)
    return lfilter([0.5 * (1 - kept), 0.5 * (1 - kept)], [1, -kept], signal - signal[0]) + signal[0]


def _predicted_block(
    conditions: Conditions, valves: Sequence[HypotheticalValve], settings: ErrorTableSettings
) -> PredictedErrors:
    drives = conditions.drives
    truths = _outputs(drives, valves)
    z = recalibrated(drives[:N_FITTED], truths[:N_FITTED], settings)
    candidates = calibrated_vector().values(np.concatenate([z, z * initial_guess_ratio()]))
    shift = np.tile(start_shift(drives, truths), 2)
    models = Replay(drives, Parameters.calibrated()).outputs(candidates, shift)
    pairs = zip(truths, models, strict=True)
    errors = np.stack([_relative_errors(truth, model) for truth, model in pairs], axis=2)
    return PredictedErrors(calibrated=errors[0], initial=errors[1, :, :N_FITTED], z=z)


def _outputs(drives: Sequence[ModelInputs], valves: Sequence[HypotheticalValve]) -> list[NDArray]:
    """Outputs of n valves in each test [SI], (3, samples, n)."""
    base = Parameters.calibrated()
    symbols = {symbol for valve in valves for symbol in valve.values} | {CALIBRATED_SYMBOLS[0]}
    nominal = {symbol: [base[symbol]] * len(drives) for symbol in symbols}
    every = [{**nominal, **valve.values} for valve in valves]
    outputs = Replay(drives, base).outputs({s: np.array([one[s] for one in every]) for s in symbols})
    for drive, truth in zip(drives, outputs, strict=True):
        current = truth[OUTPUTS.index("I")]
        for lane, valve in enumerate(valves):
            if valve.current_lag:
                current[:, lane] = lagged(current[:, lane], valve.current_lag, drive.period)
    return outputs


def _relative_errors(truth: NDArray, model: NDArray) -> NDArray:
    """Eq. 19 with what the sensors' noise adds on average [%], (2, n, 3 outputs).

    truth: (3 outputs, samples, n) [SI]. model: (3 outputs, samples, 2 n) [SI], calibrated models first.
    """
    weight = relative_weights(truth)[:, :, None]
    difference = truth[:, :, None] - model.reshape(*truth.shape[:2], 2, -1)
    noise = np.array([SENSORS[output].noise * UNITS[output][1] for output in OUTPUTS])
    square = np.einsum("oscn->cno", (weight * difference) ** 2)
    square += np.einsum("oscn,o->cno", weight**2, noise**2)
    return np.nan_to_num(100.0 * np.sqrt(square), nan=np.inf)


def _printed_cells(*tables: int) -> NDArray:
    rows = [row for number in tables for row in printed_errors(number).values()]
    return np.array([[row[output] for output in OUTPUTS] for row in rows])
