"""The sensitivity study (section 5) in one call, for the HTML page and as JSON."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from epv_env.plant.parameters import Parameters, confidence_intervals, sensitive_symbols, table
from identification.report.page import Picture, Section, Table, Verdict
from identification.report_2003 import (
    CIRCUIT_PRESSURE,
    ENERGISED_VOLTAGE,
    SUPPLY_PRESSURE,
)
from identification.sensitivity import figures
from identification.sensitivity.collinearity import CRITICAL_INDEX, OutputSensitivities
from identification.sensitivity.global_indices import (
    SobolIndices,
    ranges,
    sobol_indices,
    total_error_model,
)
from identification.sensitivity.one_at_a_time import ErrorSensitivity, sensitivities, studied_symbols

SAMPLES = 256
"""Of Sobol's design, a power of two: 6656 valves."""


@dataclass(frozen=True, kw_only=True)
class SensitivityStudy:
    """Everything that section 5 asks, and what it left out."""

    one_at_a_time: Mapping[str, ErrorSensitivity]
    """Tables 8 and 9, by symbol."""
    outputs: OutputSensitivities
    indices: SobolIndices


def run_sensitivity_study(*, outputs: OutputSensitivities, seed: int) -> SensitivityStudy:
    """All studies of the nominal valve (Tables 5 to 7).

    outputs: how the outputs respond on recordings. seed: of Sobol's design. Raises SimulationError.
    """
    p, symbols = Parameters.nominal(), studied_symbols()
    model, bounds = total_error_model(p, symbols), ranges(p, symbols)
    return SensitivityStudy(
        one_at_a_time=sensitivities(p, symbols),
        outputs=outputs,
        indices=sobol_indices(model, symbols, bounds, samples=SAMPLES, seed=seed),
    )


def sensitivity_section(study: SensitivityStudy) -> Section:
    """Everything that is shown of the study."""
    return Section(
        title="Parametric sensitivity",
        verdicts=[*_separability(study.outputs), _dominant(study.indices)],
        blocks=[
            _errors(study.one_at_a_time),
            _pairs(study.outputs),
            Picture(
                figure=figures.collinearity_map(study.outputs),
                caption="Collinearity of pairs of parameters in p2, p3 and I of the calibration "
                "recordings, weighted by the sensors' noise (Brun et al. 2001).",
            ),
            Picture(
                figure=figures.global_bars(study.indices),
                caption="Global sensitivity of the total error, all parameters within ±5 % at once "
                "(a1 within ±0.05 rad), with bootstrap 95 % intervals.",
            ),
        ],
    )


def sensitivity_json(study: SensitivityStudy) -> dict[str, Any]:
    """All figures; total errors in percent, infinite indices as None."""
    return {
        "conditions": {
            "p1_bar": SUPPLY_PRESSURE / 1e5,
            "p2_bar": CIRCUIT_PRESSURE / 1e5,
            "U_on_V": ENERGISED_VOLTAGE,
        },
        "exact": {symbol: row.as_json() for symbol, row in study.one_at_a_time.items()},
        "collinearity": _collinearity(study.outputs),
        "sobol": _indices(study.indices),
    }


def pair_of_percentages(values: tuple[float, float]) -> str:
    """Total errors for the lower and the higher value of a parameter [%], for a cell of a table."""
    return f"{values[0]:.3g} / {values[1]:.3g}"


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


def _dominant(indices: SobolIndices) -> Verdict:
    order = sorted(zip(indices.total, indices.symbols, strict=True), reverse=True)
    names = ", ".join(f"{symbol} {value:.2f}" for value, symbol in order[:4])
    return Verdict(status="note", text=f"Greatest total Sobol indices of the total error: {names}.")


def _errors(rows: Mapping[str, ErrorSensitivity]) -> Table:
    """How far the responses move with each parameter, the most sensitive first."""
    errors = {symbol: row.percentages for symbol, row in rows.items()}
    order = sorted(errors, key=lambda symbol: max(errors[symbol]), reverse=True)
    return Table(
        columns=["Parameter", "total error for −10 % / +10 % [%]"],
        rows=[[f"{table()[s].meaning} ({s})", pair_of_percentages(errors[s])] for s in order],
        caption="How far the responses move when one parameter changes. a1 is zero and goes to the ends "
        "of its domain, ±0.1 rad.",
    )


def _pairs(outputs: OutputSensitivities) -> Table:
    return Table(
        columns=["Pair", "collinearity index"],
        rows=[[f"{a}, {b}", _index(index)] for a, b, index in outputs.inseparable_pairs()],
        caption=f"Pairs above {CRITICAL_INDEX:g}: a change of one can be made up for by the other.",
    )


def _index(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "infinite"


def _collinearity(outputs: OutputSensitivities) -> dict[str, Any]:
    return {
        "of": "the calibration recordings",
        "effect_noise_sd": dict(zip(outputs.symbols, outputs.effect.tolist(), strict=True)),
        "critical_index": CRITICAL_INDEX,
        "inseparable_pairs": [[a, b, _finite(index)] for a, b, index in outputs.inseparable_pairs()],
        "calibrated_four": _finite(outputs.index(tuple(confidence_intervals()))),
        "all_sensitive": _finite(outputs.index(sensitive_symbols())),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _indices(indices: SobolIndices) -> dict[str, Any]:
    table = zip(
        indices.symbols,
        indices.first.tolist(),
        indices.first_half_width.tolist(),
        indices.total.tolist(),
        indices.total_half_width.tolist(),
        strict=True,
    )
    return {
        symbol: {"first": first, "first_half_width95": a, "total": total, "total_half_width95": b}
        for symbol, first, a, total, b in table
    }
