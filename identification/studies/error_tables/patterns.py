"""The error tables that a valve with a cause would have given: Tables 11, 13 and 15 predicted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from epv_env.plant.parameters import Parameters
from epv_env.plant.sensors import SENSORS
from identification.recordings.recording import OUTPUTS, UNITS
from identification.replay.batch_simulation import Replay
from identification.replay.model_inputs import ModelInputs
from identification.report_2003.printed_values import printed_errors
from identification.studies.error_tables.bench_conditions import N_FITTED, Conditions
from identification.studies.error_tables.recalibration import (
    SYMBOLS,
    recalibrated,
    relative_weights,
    start_shift,
    vector,
)

AT_ONCE = 64
"""Valves that are fitted together: about 100 MB."""


@dataclass(frozen=True, kw_only=True)
class Valve:
    """A made-up real valve with its bench."""

    values: Mapping[str, Sequence[float]]
    """Departures from Table 12 by symbol, one value per test [SI]."""
    current_lag: float = 0.0
    """Time constant of the current's measurement [s]."""


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """Errors of n valves [%], and where their recalibrated parameters end."""

    after: NDArray
    """Tables 13 and 15, (n, tests, outputs); infinite where a valve cannot be integrated."""
    before: NDArray
    """Table 11, the model being off its optimum as Table 10 is off Table 12, (n, 4, outputs)."""
    z: NDArray
    """Recalibrated over true parameters, (n, 4)."""


def printed_after() -> NDArray:
    """Tables 13 and 15 [%], (tests, outputs)."""
    return _cells(13, 15)


def printed_before() -> NDArray:
    """Table 11 [%], (4, outputs)."""
    return _cells(11)


def predicted(conditions: Conditions, valves: Sequence[Valve]) -> Prediction:
    """Predicted tables of n valves under the same conditions."""
    parts = [
        _predicted(conditions, valves[first : first + AT_ONCE])
        for first in range(0, len(valves), AT_ONCE)
    ]
    return Prediction(
        after=np.concatenate([part.after for part in parts]),
        before=np.concatenate([part.before for part in parts]),
        z=np.concatenate([part.z for part in parts]),
    )


def initial_ratio() -> NDArray:
    """Table 10 over Table 12, (4,)."""
    guess, calibrated = Parameters.initial_guess(), Parameters.calibrated()
    return np.array([guess[symbol] / calibrated[symbol] for symbol in SYMBOLS])


def _predicted(conditions: Conditions, valves: Sequence[Valve]) -> Prediction:
    drives = conditions.drives
    truths = _truths(drives, valves)
    z = recalibrated(drives[:N_FITTED], truths[:N_FITTED])
    candidates = vector().values(np.concatenate([z, z * initial_ratio()]))
    shift = np.tile(start_shift(drives, truths), 2)
    models = Replay(drives, Parameters.calibrated()).outputs(candidates, shift)
    pairs = zip(truths, models, strict=True)
    errors = np.stack([_errors(truth, model) for truth, model in pairs], axis=2)
    return Prediction(after=errors[0], before=errors[1, :, :N_FITTED], z=z)


def _truths(drives: Sequence[ModelInputs], valves: Sequence[Valve]) -> list[NDArray]:
    """Outputs of the valves in each test, (3, samples, n)."""
    base = Parameters.calibrated()
    symbols = {symbol for valve in valves for symbol in valve.values} | {SYMBOLS[0]}
    nominal = {symbol: [base[symbol]] * len(drives) for symbol in symbols}
    every = [{**nominal, **valve.values} for valve in valves]
    outputs = Replay(drives, base).outputs({s: np.array([one[s] for one in every]) for s in symbols})
    for drive, truth in zip(drives, outputs, strict=True):
        current = truth[OUTPUTS.index("I")]
        for lane, valve in enumerate(valves):
            if valve.current_lag:
                current[:, lane] = lagged(current[:, lane], valve.current_lag, drive.period)
    return outputs


def lagged(signal: NDArray, time_constant: float, period: float) -> NDArray:
    """A sampled signal behind a first-order filter that starts in steady state, (samples,)."""
    kept = np.exp(-period / time_constant)
    return lfilter([0.5 * (1 - kept), 0.5 * (1 - kept)], [1, -kept], signal - signal[0]) + signal[0]


def _errors(truth: NDArray, model: NDArray) -> NDArray:
    """Eq. 19 with what the sensors' noise adds on average [%], for both halves of the model's lanes.

    truth: (outputs, samples, n). model: (outputs, samples, 2 n). Returns (2, n, outputs).
    """
    weight = relative_weights(truth)[:, :, None]
    difference = truth[:, :, None] - model.reshape(*truth.shape[:2], 2, -1)
    noise = np.array([SENSORS[output].noise * UNITS[output][1] for output in OUTPUTS])
    square = np.einsum("oscn->cno", (weight * difference) ** 2)
    square += np.einsum("oscn,o->cno", weight**2, noise**2)
    return np.nan_to_num(100.0 * np.sqrt(square), nan=np.inf)


def _cells(*tables: int) -> NDArray:
    rows = [row for number in tables for row in printed_errors(number).values()]
    return np.array([[row[output] for output in OUTPUTS] for row in rows])
