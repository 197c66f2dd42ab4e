"""Tables 8 and 9 computed as the report most likely did, beside the printed figures.

The report's rows of the armature most likely carry the scatter of its own simulation: with a fixed step
of 0.5 ms the plant's equations show it too, with exactly located stops they do not.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from docs.studies.reproduction.fixed_step import simulate_fixed_step
from docs.studies.reproduction.one_at_a_time import (
    ErrorSensitivity,
    printed_sensitivities,
    sensitivities,
)
from epv_env.plant.parameters import Parameters, table
from identification.report_2003 import ENERGISED_VOLTAGE
from identification.sensitivity import studied_symbols

FIXED_STEP_VOLTAGE = 18.835
"""U_on [V] for the fixed step, whose scatter changes within 0.02 V: this voltage, 0.065 V below the
fitted one, lies amid 0.01 V where every class is as printed."""

SCATTER_VOLTAGES = np.append(np.linspace(18.5, 19.3, 17), FIXED_STEP_VOLTAGE)
"""Voltages over which the scatter of the fixed step is shown [V]."""

RELATIVE_AGREEMENT, ABSOLUTE_AGREEMENT = 0.1, 0.1
"""A figure is reproduced if it differs from the printed one by at most this fraction of it, or by at
most this many percentage points."""

TABLES = (8, 9)
"""The report's tables of sensitivities."""

NOT_COUNTED = ("a1",)
"""Its change is not printed: what it must have been is this project's guess."""


@dataclass(frozen=True, kw_only=True)
class OneAtATime:
    """Tables 8 and 9, computed three ways; by symbol."""

    fixed_step: Mapping[str, ErrorSensitivity]
    """As the report most likely simulated: a fixed step of 0.5 ms."""
    exact: Mapping[str, ErrorSensitivity]
    """With the plant's own integrator, which locates every stop."""
    scatter: Mapping[str, NDArray]
    """Total errors with the fixed step at each of SCATTER_VOLTAGES, fractions, (voltages, 2)."""


def run_one_at_a_time() -> OneAtATime:
    """Tables 8 and 9 for the nominal values of Tables 5 to 7."""
    return OneAtATime(
        fixed_step=_fixed_step(FIXED_STEP_VOLTAGE),
        exact=sensitivities(Parameters.nominal(), studied_symbols()),
        scatter=_scatter(),
    )


def _fixed_step(U_on: float) -> dict[str, ErrorSensitivity]:
    """The tables with the fixed step, at a voltage [V]."""
    return sensitivities(
        Parameters.nominal(), studied_symbols(), U_on=U_on, simulator=simulate_fixed_step
    )


def _scatter() -> dict[str, NDArray]:
    runs = [_fixed_step(U_on) for U_on in SCATTER_VOLTAGES.tolist()]
    return {
        symbol: np.array([[run[symbol].minus, run[symbol].plus] for run in runs])
        for symbol in studied_symbols()
    }


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


def is_reproduced(percent: float, printed: float) -> bool:
    """Whether a figure [%] is the printed one within the tolerance."""
    tolerance = max(RELATIVE_AGREEMENT * printed, ABSOLUTE_AGREEMENT)
    return abs(percent - printed) <= tolerance


def agreement_with_printed(rows: Mapping[str, ErrorSensitivity]) -> PrintedAgreement:
    """Compare a computation with the printed tables; its classes of all symbols, a1's figures apart."""
    pairs = [
        pair
        for symbol, printed in printed_sensitivities().items()
        if symbol not in NOT_COUNTED
        for pair in zip(rows[symbol].percentages, printed, strict=True)
    ]
    return PrintedAgreement(
        figures=len(pairs),
        reproduced=sum(is_reproduced(*pair) for pair in pairs),
        classes_differ=tuple(
            s for s in printed_sensitivities() if rows[s].sensitive != table()[s].sensitive
        ),
        worst_factor=max(max(a / b, b / a) for a, b in pairs),
    )


def sensitivity_tables(study: OneAtATime) -> dict[str, Any]:
    """JSON-ready 'table8' and 'table9' (fixed step), and 'comparison' with the report's [%]."""
    content: dict[str, Any] = {
        f"table{number}": {
            symbol: study.fixed_step[symbol].as_json() for symbol in printed_sensitivities(number)
        }
        for number in TABLES
    }
    content["comparison"] = {
        "fixed_step": _summary(study.fixed_step, FIXED_STEP_VOLTAGE),
        "exact": _summary(study.exact, ENERGISED_VOLTAGE),
        "rows": {symbol: _compared(study, symbol) for symbol in printed_sensitivities()},
    }
    return content


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
    printed = printed_sensitivities()[symbol]
    return {
        "printed": list(printed),
        "fixed_step": list(study.fixed_step[symbol].percentages),
        "fixed_step_lowest": (100 * study.scatter[symbol].min(axis=0)).tolist(),
        "fixed_step_highest": (100 * study.scatter[symbol].max(axis=0)).tolist(),
        "exact": list(study.exact[symbol].percentages),
        "printed_sensitive": table()[symbol].sensitive,
    }
