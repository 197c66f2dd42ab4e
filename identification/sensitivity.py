"""Which parameters matter to a campaign's recordings, and which these cannot tell apart (section 5).

Brun, Reichert and Künsch, Practical identifiability analysis of large environmental simulation models,
Water Resources Research 37 (2001): the collinearity index of a set of parameters is 1/sqrt of the
least eigenvalue of the matrix of cosines between their sensitivities. It is 1 if they are orthogonal;
at an index of 10, a change of one that the others make up for leaves a tenth of its effect.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.parameters import confidence_intervals, sensitive_symbols, table
from identification.recordings.recording import OUTPUTS
from identification.replay.replay import Replay
from identification.report.page import Section, Table, Verdict

DIFFERENCE_STEP = 2e-3
"""Step of the central differences: in the logarithm of a value; in half widths of the domain where the
value is zero."""

CRITICAL_INDEX = 10.0
"""Collinearity index from which parameters are poorly identifiable (Brun et al.: 10 to 15)."""


@dataclass(frozen=True, kw_only=True)
class OutputSensitivities:
    """How the outputs of all recordings respond to each parameter, in standard deviations of noise."""

    symbols: tuple[str, ...]
    columns: NDArray
    """Change of each output for the stated change, (samples, parameters) [deviations of noise]."""

    @property
    def effect(self) -> NDArray:
        """Root mean square of each column [standard deviations of the noise], (parameters,)."""
        return np.sqrt(np.mean(np.square(self.columns), axis=0))

    def index(self, symbols: Sequence[str]) -> float:
        """Collinearity index of a set of parameters; infinite if one can replace another exactly."""
        return collinearity_index(self.columns[:, [self.symbols.index(symbol) for symbol in symbols]])

    def inseparable_pairs(self) -> list[tuple[str, str, float]]:
        """(symbol, symbol, index) of every pair above the critical index, the worst first."""
        pairs = [(a, b, self.index((a, b))) for a, b in combinations(self.symbols, 2)]
        return sorted((p for p in pairs if p[2] > CRITICAL_INDEX), key=lambda p: -p[2])


def studied_symbols() -> list[str]:
    """The parameters of Tables 6 and 7."""
    return [symbol for symbol, row in table().items() if row.source in ("Table 6", "Table 7")]


def cosines(columns: NDArray) -> NDArray:
    """Cosines between columns (samples, n) [any unit], as (n, n)."""
    unit = columns / np.linalg.norm(columns, axis=0)
    return np.clip(unit.T @ unit, -1.0, 1.0)


def collinearity_index(columns: NDArray) -> float:
    """Brun et al.'s index of columns (samples, n) [any unit]: between 1 and infinity."""
    least = np.linalg.eigvalsh(cosines(columns))[0]
    return float(1 / np.sqrt(least)) if least > 1e-12 else np.inf  # but for rounding


def stepped(symbol: str, value: float) -> NDArray:
    """A value [SI] one step down and up, (2,).

    Steps in the logarithm: two parameters that act by their ratio then have opposite columns exactly.
    """
    domain = table()[symbol].domain
    if value == 0.0 and domain is not None:
        return value + DIFFERENCE_STEP * (domain[1] - domain[0]) / 2 * np.array([-1.0, 1.0])
    return value * np.exp(DIFFERENCE_STEP * np.array([-1.0, 1.0]))


def sensitivities_on_recordings(
    replay: Replay, symbols: Sequence[str], noise: Mapping[str, float]
) -> OutputSensitivities:
    """How the outputs respond on recorded inputs, in units of the measured noise by output [SI].

    By central differences, stated for a change of 0.1, that of Table 8.
    """
    deviation = np.array([noise[name] for name in OUTPUTS])[:, None, None]
    width = 2 * DIFFERENCE_STEP * deviation
    columns = [
        ((y[..., 1::2] - y[..., ::2]) * 0.1 / width).reshape(-1, len(symbols))
        for y in replay.outputs(_both_ways(replay.base, symbols))
    ]
    return OutputSensitivities(symbols=tuple(symbols), columns=np.concatenate(columns))


def _both_ways(nominal: Mapping[str, float], symbols: Sequence[str]) -> dict[str, NDArray]:
    """Parameters by symbol (2 symbols,): each symbol one step down and up, the others nominal."""
    p = {symbol: np.full(2 * len(symbols), value) for symbol, value in nominal.items()}
    for row, symbol in enumerate(symbols):
        p[symbol][2 * row : 2 * row + 2] = stepped(symbol, nominal[symbol])
    return p


def sensitivity_section(outputs: OutputSensitivities) -> Section:
    """How far each parameter moves the recordings' outputs, and which these cannot tell apart."""
    effects = dict(zip(outputs.symbols, outputs.effect.tolist(), strict=True))
    order = sorted(effects, key=lambda symbol: -effects[symbol])
    return Section(
        title="Parametric sensitivity",
        verdicts=_separability(outputs),
        blocks=[
            Table(
                columns=["Parameter", "effect of +10 % [noise deviations]"],
                rows=[[f"{table()[s].meaning} ({s})", f"{effects[s]:.3g}"] for s in order],
                caption="Root mean square over the outputs of the calibration recordings. a1 is zero: "
                "a tenth of its domain's half width.",
            ),
            Table(
                columns=["Pair", "collinearity index"],
                rows=[[f"{a}, {b}", _index(index)] for a, b, index in outputs.inseparable_pairs()],
                caption=f"Pairs above {CRITICAL_INDEX:g}: a change of one can be made up for by the "
                "other.",
            ),
        ],
    )


def sensitivity_json(outputs: OutputSensitivities) -> dict[str, Any]:
    """All figures; infinite indices as None."""
    return {
        "collinearity": {
            "of": "the calibration recordings",
            "effect_noise_sd": dict(zip(outputs.symbols, outputs.effect.tolist(), strict=True)),
            "critical_index": CRITICAL_INDEX,
            "inseparable_pairs": [[a, b, _finite(index)] for a, b, index in outputs.inseparable_pairs()],
            "calibrated_four": _finite(outputs.index(tuple(confidence_intervals()))),
            "all_sensitive": _finite(outputs.index(sensitive_symbols())),
        }
    }


def _separability(outputs: OutputSensitivities) -> list[Verdict]:
    four, sensitive = outputs.index(tuple(confidence_intervals())), outputs.index(sensitive_symbols())
    pairs, critical = outputs.inseparable_pairs(), CRITICAL_INDEX
    return [
        Verdict(
            status="good" if four < critical else "bad",
            text=f"The four calibrated parameters together have a collinearity index of {four:.1f}; "
            f"below {critical:g} data can tell them apart.",
        ),
        Verdict(
            status="good" if sensitive < critical else "note",
            text=f"All {len(sensitive_symbols())} sensitive ones together: {_index(sensitive)}. "
            f"{len(pairs)} pairs cannot be told apart, first "
            f"{' and '.join(f'{a}, {b}' for a, b, _ in pairs[:2])}, which act by their ratio alone.",
        ),
    ]


def _index(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "infinite"


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
