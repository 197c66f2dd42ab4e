"""What the report says of sensitivity (section 5): two tables, and as JSON."""

import math
from collections.abc import Mapping
from typing import Any

from epv_env.plant.parameters import confidence_intervals, sensitive_symbols, table
from identification.report.page import Section, Table, Verdict
from identification.report_2003 import CIRCUIT_PRESSURE, ENERGISED_VOLTAGE, SUPPLY_PRESSURE
from identification.sensitivity.collinearity import CRITICAL_INDEX, OutputSensitivities
from identification.sensitivity.one_at_a_time import ErrorSensitivity

Errors = Mapping[str, ErrorSensitivity]
"""Tables 8 and 9, by symbol."""


def sensitivity_section(errors: Errors, outputs: OutputSensitivities) -> Section:
    """How far each parameter moves the responses, and which the recordings cannot tell apart."""
    return Section(
        title="Parametric sensitivity",
        verdicts=_separability(outputs),
        blocks=[
            _errors(errors),
            Table(
                columns=["Pair", "collinearity index"],
                rows=[[f"{a}, {b}", _index(index)] for a, b, index in outputs.inseparable_pairs()],
                caption=f"Pairs above {CRITICAL_INDEX:g}: a change of one can be made up for by the "
                "other.",
            ),
        ],
    )


def sensitivity_json(errors: Errors, outputs: OutputSensitivities) -> dict[str, Any]:
    """All figures; total errors in percent, infinite indices as None."""
    return {
        "conditions": {
            "p1_bar": SUPPLY_PRESSURE / 1e5,
            "p2_bar": CIRCUIT_PRESSURE / 1e5,
            "U_on_V": ENERGISED_VOLTAGE,
        },
        "exact": {symbol: row.as_json() for symbol, row in errors.items()},
        "collinearity": {
            "of": "the calibration recordings",
            "effect_noise_sd": dict(zip(outputs.symbols, outputs.effect.tolist(), strict=True)),
            "critical_index": CRITICAL_INDEX,
            "inseparable_pairs": [[a, b, _finite(index)] for a, b, index in outputs.inseparable_pairs()],
            "calibrated_four": _finite(outputs.index(tuple(confidence_intervals()))),
            "all_sensitive": _finite(outputs.index(sensitive_symbols())),
        },
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


def _errors(errors: Errors) -> Table:
    """How far the responses move with each parameter, the most sensitive first."""
    order = sorted(errors.items(), key=lambda row: max(row[1].percentages), reverse=True)
    return Table(
        columns=["Parameter", "total error for −10 % / +10 % [%]"],
        rows=[
            [f"{table()[symbol].meaning} ({symbol})", "{:.3g} / {:.3g}".format(*row.percentages)]
            for symbol, row in order
        ],
        caption="How far the responses move when one parameter changes. a1 is zero and goes to the ends "
        "of its domain, ±0.1 rad.",
    )


def _index(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "infinite"


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
