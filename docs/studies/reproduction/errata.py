"""A printed figure checked against the report's others; checks of parameters and error tables."""

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

from epv_env.plant.parameters import Parameters, confidence_intervals, table
from identification.recordings.recording import OUTPUTS
from identification.report_2003 import (
    CALIBRATION_CASES,
    SAMPLING_RATE,
    printed_errors,
    printed_sensitivities,
    printed_total,
    total_error,
)
from identification.sensitivity.one_at_a_time import FACTORS

HOLDS, ERRATUM, DOUBT = "holds", "slip", "doubt"
"""Values of `status` in reproduce.json.

HOLDS: the printed figures agree. ERRATUM: they contradict each other. DOUBT: they are hard to believe
together.
"""

ERROR_ROUNDING = 1.5e-4
"""Tolerance of a root of squares of errors that are printed to 1e-4 [%]."""
IMPROVEMENT_ROUNDING = 0.01
"""Tolerance of a relative fall of the total error [%], printed to two digits here."""
CONFIDENCE = 0.95
"""Confidence of the band of a correlation, and probability of the F quantile of eq. 23 [-]."""
CENTRAL_POSITIONS = (0.25, 0.75)
"""Positions of an estimate in its confidence interval, from 0 at the lower to 1 at the upper end, that
are no doubt."""


@dataclass(frozen=True, kw_only=True)
class FigureCheck:
    """A printed value beside the same value recomputed from the report's other figures.

    The fields are those of an entry of `slips` in reproduce.json.
    """

    where: str
    """Table, equation or section, and the quantity with its unit."""
    printed: str
    """The printed value."""
    recomputed: str
    """The recomputed value, or what contradicts the printed one."""
    status: str
    """HOLDS, ERRATUM or DOUBT."""
    remark: str = ""
    """What rule the recomputation uses, and what follows."""


def numeric_check(
    where: str, printed: float, recomputed: float, tolerance: float, *, digits: int = 4, remark: str = ""
) -> FigureCheck:
    """Check that two numbers of the same unit differ by at most `tolerance`; else ERRATUM.

    Args:
        where: table and quantity, with the unit.
        printed: the report's number.
        recomputed: the number that the report's other figures give, in the same unit.
        tolerance: what the rounding of the figures behind them allows, in the same unit.
        digits: decimals that are shown.
        remark: what rule the recomputation uses.
    """
    return FigureCheck(
        where=where,
        printed=f"{printed:.{digits}f}",
        recomputed=f"{recomputed:.{digits}f}",
        status=HOLDS if abs(printed - recomputed) <= tolerance else ERRATUM,
        remark=remark,
    )


PRINTED_PERMEABILITY = 4 * math.pi * 1e7
"""Permeability of vacuum in Table 5 [V s/(A m)]."""

PRINTED_SIGNALS = ("I", "U", "p2", "p2", "p3")
"""'five acquired signals that are as follows' (section 3)."""


def parameter_checks() -> list[FigureCheck]:
    """Checks of sections 3, 5.1 and 6 that do not all hold."""
    return [
        _permeability(),
        *(_position(symbol) for symbol in confidence_intervals()),
        _degrees_of_freedom(),
        _signals(),
    ]


def measurement_points() -> int:
    """Samples of all outputs in the four calibration tests."""
    return len(OUTPUTS) * sum(len(case.voltage(1.0, SAMPLING_RATE)) for case in CALIBRATION_CASES)


def _permeability() -> FigureCheck:
    true = table()["mu0"].value
    return FigureCheck(
        where="Table 5, permeability of vacuum [V s/(A m)]",
        printed=f"{PRINTED_PERMEABILITY:.4g}",
        recomputed=f"{true:.4g}",
        status=HOLDS if math.isclose(PRINTED_PERMEABILITY, true) else ERRATUM,
        remark="10^7 for 1e-7: the printed value is "
        f"{PRINTED_PERMEABILITY / true:.0e} times the constant",
    )


def interval_position(symbol: str) -> float:
    """Position of Table 12's estimate in Table 14's interval [-]: 0 at the lower end, 1 at the upper."""
    low, high = confidence_intervals()[symbol]
    return (Parameters.calibrated()[symbol] - low) / (high - low)


def _position(symbol: str) -> FigureCheck:
    position, (low, high) = interval_position(symbol), confidence_intervals()[symbol]
    least, most = CENTRAL_POSITIONS
    return FigureCheck(
        where=f"Tables 12 and 14, {symbol} in its 95 % interval",
        printed=f"{Parameters.calibrated()[symbol]:.7g} in [{low:.7g}, {high:.7g}]",
        recomputed=f"at {100 * position:.1f} % of the interval",
        status=HOLDS if least <= position <= most else DOUBT,
        remark="about 50 % at a smooth minimum: the interval reaches "
        f"{position / (1 - position):.0f} times as far down as up",
    )


def _degrees_of_freedom() -> FigureCheck:
    k, v = measurement_points(), len(confidence_intervals())
    quantile = float(stats.f.ppf(CONFIDENCE, v, k - v))
    factor = math.sqrt(1 + v / (k - v) * quantile)
    return FigureCheck(
        where="Eq. 23, degrees of freedom of F(k, v - k, p)",
        printed=f"{k}, {v - k}",
        recomputed=f"{v}, {k - v}",
        status=ERRATUM if v - k < 0 else HOLDS,
        remark="with k points and v parameters, as defined, v - k is negative; F(v, k - v, p) is meant: "
        f"{quantile:.3f}. The bound holds for a sum of squares; for the root mean square of eq. 21 the "
        f"factor is sqrt(1 + v/(k - v) F) = {factor:.6f}",
    )


def _signals() -> FigureCheck:
    return FigureCheck(
        where="Section 3, acquired signals",
        printed=", ".join(PRINTED_SIGNALS),
        recomputed="I, U, p1, p2, p3",
        status=ERRATUM if len(set(PRINTED_SIGNALS)) < len(PRINTED_SIGNALS) else HOLDS,
        remark="p2 stands twice and p1 is missing; Table 1 lists all five",
    )


def recomputed_total(number: int) -> float:
    """Total error by eq. 21 [%] from the printed partial errors of Table 11 or 13."""
    return float(total_error([np.array(test["partial"]) for test in printed_errors(number).values()]))


def error_table_checks() -> list[FigureCheck]:
    """Checks of the error tables that do not all hold."""
    return [
        *(_total_error(number) for number in (11, 13)),
        _improvement(),
        _first_test_p2(),
        _a1_sensitivity(),
    ]


def _total_error(number: int) -> FigureCheck:
    where = f"Table {number}, total error [%]"
    remark = "eq. 21 over the printed partial errors"
    recomputed = recomputed_total(number)
    return numeric_check(where, printed_total(number), recomputed, ERROR_ROUNDING, remark=remark)


def _improvement() -> FigureCheck:
    """The claim that rests on the total of Table 13."""
    before, after = printed_total(11), (printed_total(13), recomputed_total(13))
    printed, recomputed = (100 * (1 - total / before) for total in after)
    remark = "what the calibration gained, with the printed and with the recomputed total"
    where = "Tables 11 and 13, fall of the total error [% of it]"
    return numeric_check(where, printed, recomputed, IMPROVEMENT_ROUNDING, digits=2, remark=remark)


def _first_test_p2() -> FigureCheck:
    before, after = (printed_errors(number)["Test1"]["p2"] for number in (11, 13))
    return FigureCheck(
        where="Tables 11 and 13, Test1, error of p2 [%]",
        printed=f"{before:.4f} before, {after:.4f} after",
        recomputed="–",
        status=DOUBT if after > before else HOLDS,
        remark="the calibration makes p2, the output to be controlled, worse in the first test",
    )


def _a1_sensitivity() -> FigureCheck:
    value = table()["a1"].value
    changes = [factor * value - value for factor in FACTORS]
    minus, plus = printed_sensitivities(9)["a1"]
    return FigureCheck(
        where="Table 9, a1, total error [%]",
        printed=f"{minus:.4f} / {plus:.4f}",
        recomputed="0.0000 / 0.0000",
        status=ERRATUM if not any(changes) and max(minus, plus) > 0 else HOLDS,
        remark="10 % of a1 = 0 is no change; with a1 at the ends of its domain about these errors come "
        "out",
    )
