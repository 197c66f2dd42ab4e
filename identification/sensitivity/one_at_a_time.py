"""Parametric sensitivity, one parameter at a time: the study behind Tables 8 and 9."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.parameters import table
from epv_env.plant.simulate import simulate
from identification.sensitivity.report_conditions import (
    REPORT_CONDITIONS,
    Simulator,
    StudyConditions,
    total_errors,
)

FACTORS = (0.9, 1.1)
"""The changes of Tables 8 and 9."""

THRESHOLD = 0.02
"""Total error from which the report calls the model Sensitive to a parameter (section 5.2.2)."""


@dataclass(frozen=True, kw_only=True)
class ErrorSensitivity:
    """Total errors (eq. 21), as fractions, that two changes of one parameter cause."""

    minus: float
    """With -10 %; for a1, which is zero, with the lower end of its domain."""
    plus: float
    """With +10 %; for a1 with the upper end of its domain."""

    @property
    def sensitive(self) -> bool:
        """Whether the total error reaches the tolerance in either direction."""
        return max(self.minus, self.plus) >= THRESHOLD


def studied_symbols() -> list[str]:
    """The parameters of Tables 6 and 7."""
    return [symbol for symbol, row in table().items() if row.source in ("Table 6", "Table 7")]


def changed_values(symbol: str, nominal: float) -> tuple[float, float]:
    """The two values of one parameter that its row compares with the nominal one.

    10 % of a zero is no change, yet Table 9 prints errors for a1: a parameter that is zero goes to
    the ends of its domain instead.
    """
    domain = table()[symbol].domain
    if nominal == 0.0 and domain is not None:
        return domain
    return FACTORS[0] * nominal, FACTORS[1] * nominal


def variants(nominal: Mapping[str, float], symbols: Sequence[str]) -> dict[str, NDArray]:
    """Parameters by symbol [SI], (variants,): the nominal ones, then each symbol lowered and raised.

    There are 1 + 2 symbols variants.
    """
    p = {symbol: np.full(1 + 2 * len(symbols), value) for symbol, value in nominal.items()}
    for row, symbol in enumerate(symbols):
        p[symbol][1 + 2 * row : 3 + 2 * row] = changed_values(symbol, nominal[symbol])
    return p


def sensitivities(
    nominal: Mapping[str, float],
    symbols: Sequence[str],
    *,
    conditions: StudyConditions = REPORT_CONDITIONS,
    simulator: Simulator = simulate,
) -> dict[str, ErrorSensitivity]:
    """Total errors against the nominal model by symbol; all variants run in one batch."""
    errors = total_errors(variants(nominal, symbols), conditions, simulator)
    pairs = errors.reshape(-1, 2).tolist()
    return {
        symbol: ErrorSensitivity(minus=minus, plus=plus)
        for symbol, (minus, plus) in zip(symbols, pairs, strict=True)
    }
