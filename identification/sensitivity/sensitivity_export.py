"""The sensitivity study as JSON-ready data."""

import math
from typing import Any

from epv_env.plant.parameters import confidence_intervals, sensitive_symbols
from identification.sensitivity.collinearity import OutputSensitivities
from identification.sensitivity.global_indices import MorrisEffects, SobolIndices
from identification.sensitivity.one_at_a_time import ErrorSensitivity
from identification.sensitivity.report_conditions import REPORT_CONDITIONS
from identification.sensitivity.sensitivity_study import FIXED_STEP_CONDITIONS, SensitivityStudy


def as_json(study: SensitivityStudy) -> dict[str, Any]:
    """All figures; total errors in percent, infinite indices as None."""
    rows = study.one_at_a_time
    return {
        "conditions": {
            "p1_bar": REPORT_CONDITIONS.p1 / 1e5,
            "p2_bar": REPORT_CONDITIONS.p2 / 1e5,
            "U_on_V": REPORT_CONDITIONS.U_on,
            "U_on_fixed_step_V": FIXED_STEP_CONDITIONS.U_on,
        },
        "fixed_step": {symbol: _row(row) for symbol, row in rows.fixed_step.items()},
        "exact": {symbol: _row(row) for symbol, row in rows.exact.items()},
        "collinearity": _collinearity(study.outputs),
        "morris": _screening(study.screening),
        "sobol": _indices(study.indices),
    }


def _row(row: ErrorSensitivity) -> dict[str, Any]:
    return {"minus10": 100 * row.minus, "plus10": 100 * row.plus, "sensitive": row.sensitive}


def _collinearity(outputs: OutputSensitivities) -> dict[str, Any]:
    return {
        "of": outputs.where,
        "effect_noise_sd": dict(zip(outputs.symbols, outputs.effect.tolist(), strict=True)),
        "critical_index": outputs.settings.critical_index,
        "inseparable_pairs": [[a, b, _finite(index)] for a, b, index in outputs.inseparable_pairs()],
        "calibrated_four": _finite(outputs.index(tuple(confidence_intervals()))),
        "all_sensitive": _finite(outputs.index(sensitive_symbols())),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _screening(screening: MorrisEffects) -> dict[str, Any]:
    columns = zip(
        screening.mean_absolute.tolist(),
        screening.half_width.tolist(),
        screening.spread.tolist(),
        strict=True,
    )
    return {
        symbol: {"mu_star": effect, "half_width95": width, "sigma": spread}
        for symbol, (effect, width, spread) in zip(screening.symbols, columns, strict=True)
    }


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
