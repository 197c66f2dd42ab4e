"""Which parameters the outputs cannot tell apart: scaled sensitivities and their collinearity.

Brun, Reichert and Künsch, Practical identifiability analysis of large environmental simulation models,
Water Resources Research 37 (2001): the collinearity index of a set of parameters is 1/sqrt of the
least eigenvalue of the matrix of cosines between their sensitivities. It is 1 if they are orthogonal;
at an index of 10, a change of one that the others make up for leaves a tenth of its effect.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.channels import SENSORS
from epv_env.plant.parameters import table
from identification.recordings.recording import OUTPUTS, UNITS
from identification.replay.batch_simulation import Replay
from identification.sensitivity.report_conditions import (
    REPORT_CONDITIONS,
    StudyConditions,
    output_samples,
    run_cases,
)
from identification.sensitivity.settings import SENSITIVITY, SensitivitySettings


@dataclass(frozen=True, kw_only=True)
class OutputSensitivities:
    """How all outputs of all test cases respond to each parameter, in standard deviations of noise."""

    symbols: tuple[str, ...]
    columns: NDArray
    """Change of each output sample for the stated change, in deviations of noise, (samples, "
    "parameters)."""
    where: str = "the outputs"
    """What the samples are of, for a sentence."""
    settings: SensitivitySettings = SENSITIVITY
    """Steps, stated change and limits."""

    def columns_of(self, symbols: Sequence[str]) -> NDArray:
        """The columns of some parameters, (samples, symbols) [deviations of noise]."""
        return self.columns[:, [self.symbols.index(symbol) for symbol in symbols]]

    @property
    def effect(self) -> NDArray:
        """Root mean square of each column [standard deviations of the noise], (parameters,)."""
        return np.sqrt(np.mean(np.square(self.columns), axis=0))

    @property
    def correlation(self) -> NDArray:
        """Cosines between the columns, (parameters, parameters), without unit."""
        return cosines(self.columns)

    def index(self, symbols: Sequence[str]) -> float:
        """Collinearity index of a set of parameters; infinite if one can replace another exactly."""
        return collinearity_index(self.columns_of(symbols), self.settings.zero_eigenvalue)

    def inseparable_pairs(self) -> list[tuple[str, str, float]]:
        """(symbol, symbol, index) of every pair above the critical index, the worst first."""
        pairs = [(a, b, self.index((a, b))) for a, b in combinations(self.symbols, 2)]
        return sorted(
            (pair for pair in pairs if pair[2] > self.settings.critical_index), key=lambda pair: -pair[2]
        )


def cosines(columns: NDArray) -> NDArray:
    """Cosines between columns (samples, n) [any unit], as (n, n)."""
    unit = columns / np.linalg.norm(columns, axis=0)
    return np.clip(unit.T @ unit, -1.0, 1.0)


def collinearity_index(columns: NDArray, zero: float = SENSITIVITY.zero_eigenvalue) -> float:
    """Brun et al.'s index of columns (samples, n) [any unit]: between 1 and infinity.

    zero: least eigenvalue below which one column replaces the others exactly.
    """
    least = np.linalg.eigvalsh(cosines(columns))[0]
    return float(1 / np.sqrt(least)) if least > zero else np.inf


def stepped(symbol: str, value: float, step: float = SENSITIVITY.difference_step) -> NDArray:
    """A value [SI] one step down and up, (2,).

    Steps in the logarithm: two parameters that act by their ratio then have opposite columns exactly.
    """
    domain = table()[symbol].domain
    if value == 0.0 and domain is not None:
        return value + step * (domain[1] - domain[0]) / 2 * np.array([-1.0, 1.0])
    return value * np.exp(step * np.array([-1.0, 1.0]))


def sensitivities_of_outputs(
    nominal: Mapping[str, float],
    symbols: Sequence[str],
    conditions: StudyConditions = REPORT_CONDITIONS,
    settings: SensitivitySettings = SENSITIVITY,
) -> OutputSensitivities:
    """How p2, p3 and I respond in the report's test cases, in units of Table 3's noise.

    Raises SimulationError.
    """
    runs = run_cases(_both_ways(nominal, symbols, settings.difference_step), conditions)
    noise = {name: SENSORS[name].noise * UNITS[name][1] for name in OUTPUTS}
    samples = [np.stack(output_samples(run)) for run in runs]
    return _central_differences(symbols, samples, noise, "the report's test cases", settings)


def sensitivities_on_recordings(
    replay: Replay,
    symbols: Sequence[str],
    noise: Mapping[str, float],
    settings: SensitivitySettings = SENSITIVITY,
) -> OutputSensitivities:
    """How the outputs respond on recorded inputs, in units of the measured noise by output [SI]."""
    samples = replay.outputs(_both_ways(replay.base, symbols, settings.difference_step))
    return _central_differences(symbols, samples, noise, "the calibration recordings", settings)


def _both_ways(nominal: Mapping[str, float], symbols: Sequence[str], step: float) -> dict[str, NDArray]:
    """Parameters by symbol (2 symbols,): each symbol one step down and up, the others nominal."""
    p = {symbol: np.full(2 * len(symbols), value) for symbol, value in nominal.items()}
    for row, symbol in enumerate(symbols):
        p[symbol][2 * row : 2 * row + 2] = stepped(symbol, nominal[symbol], step)
    return p


def _central_differences(
    symbols: Sequence[str],
    samples: Sequence[NDArray],
    noise: Mapping[str, float],
    where: str,
    settings: SensitivitySettings,
) -> OutputSensitivities:
    """Sensitivities from the outputs (3, samples, 2 symbols) of `_both_ways` in each test case."""
    deviation = np.array([noise[name] for name in OUTPUTS])[:, None, None]
    width = 2 * settings.difference_step * deviation
    columns = [
        ((y[..., 1::2] - y[..., ::2]) * settings.stated_change / width).reshape(-1, len(symbols))
        for y in samples
    ]
    return OutputSensitivities(
        symbols=tuple(symbols), columns=np.concatenate(columns), where=where, settings=settings
    )
