"""Tables 8 and 9 beside the report's."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from epv_env.plant.parameters import table
from identification.report_2003.printed_values import printed_sensitivities
from identification.sensitivity.one_at_a_time import ErrorSensitivity
from identification.sensitivity.report_conditions import REPORT_CONDITIONS
from identification.sensitivity.sensitivity_study import FIXED_STEP_CONDITIONS, OneAtATime
from identification.sensitivity.settings import SENSITIVITY, SensitivitySettings

TABLES = (8, 9)
"""The report's tables of sensitivities."""

NOT_COUNTED = ("a1",)
"""Its change is not printed: what it must have been is this project's guess."""


@dataclass(frozen=True, kw_only=True)
class PrintedAgreement:
    """How one computation of Tables 8 and 9 meets the printed ones."""

    figures: int
    """Figures counted."""
    reproduced: int
    """Those within the tolerance."""
    classes_differ: tuple[str, ...]
    """Symbols whose class is not as printed."""
    worst_factor: float
    """Largest ratio between a computed and a printed figure, either way."""


def percentages(row: ErrorSensitivity) -> tuple[float, float]:
    """Both total errors [%]."""
    return 100 * row.minus, 100 * row.plus


def is_reproduced(percent: float, printed: float, settings: SensitivitySettings = SENSITIVITY) -> bool:
    """Whether a figure [%] is the printed one within the tolerance."""
    tolerance = max(settings.relative_agreement * printed, settings.absolute_agreement)
    return abs(percent - printed) <= tolerance


def printed_rows() -> dict[str, tuple[float, float]]:
    """All rows of Tables 8 and 9 [%]."""
    return {symbol: pair for number in TABLES for symbol, pair in printed_sensitivities(number).items()}


def agreement_with_printed(rows: Mapping[str, ErrorSensitivity]) -> PrintedAgreement:
    """Compare a computation with the printed tables; its classes of all symbols, a1's figures apart."""
    pairs = [
        pair
        for symbol, printed in printed_rows().items()
        if symbol not in NOT_COUNTED
        for pair in zip(percentages(rows[symbol]), printed, strict=True)
    ]
    return PrintedAgreement(
        figures=len(pairs),
        reproduced=sum(is_reproduced(*pair) for pair in pairs),
        classes_differ=tuple(s for s in printed_rows() if rows[s].sensitive != table()[s].sensitive),
        worst_factor=max(max(a / b, b / a) for a, b in pairs),
    )


def sensitivity_tables(study: OneAtATime) -> dict[str, Any]:
    """JSON-ready 'table8' and 'table9' (fixed step), and 'comparison' with the report's [%]."""
    content: dict[str, Any] = {
        f"table{number}": {
            symbol: _row(study.fixed_step[symbol]) for symbol in printed_sensitivities(number)
        }
        for number in TABLES
    }
    content["comparison"] = {
        "fixed_step": _summary(study.fixed_step, FIXED_STEP_CONDITIONS.U_on),
        "exact": _summary(study.exact, REPORT_CONDITIONS.U_on),
        "rows": {symbol: _compared(study, symbol) for symbol in printed_rows()},
    }
    return content


def _row(row: ErrorSensitivity) -> dict[str, Any]:
    minus, plus = percentages(row)
    return {"minus10": minus, "plus10": plus, "sensitive": row.sensitive}


def _summary(rows: Mapping[str, ErrorSensitivity], U_on: float) -> dict[str, Any]:
    met = agreement_with_printed(rows)
    return {
        "U_on_V": U_on,
        "figures": met.figures,
        "reproduced": met.reproduced,
        "classes_differ": list(met.classes_differ),
        "worst_factor": met.worst_factor,
    }


def _compared(study: OneAtATime, symbol: str) -> dict[str, Any]:
    printed = printed_rows()[symbol]
    return {
        "printed": list(printed),
        "fixed_step": list(percentages(study.fixed_step[symbol])),
        "fixed_step_lowest": (100 * study.scatter[symbol].min(axis=0)).tolist(),
        "fixed_step_highest": (100 * study.scatter[symbol].max(axis=0)).tolist(),
        "exact": list(percentages(study.exact[symbol])),
        "printed_sensitive": table()[symbol].sensitive,
    }
