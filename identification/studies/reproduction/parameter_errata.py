"""Checks of the parameter tables, of eq. 23 and of what the text counts."""

import math

from scipy import stats

from epv_env.plant.parameters import Parameters, confidence_intervals, table
from identification.recordings.recording import OUTPUTS
from identification.report_2003.cases import CALIBRATION_CASES, SAMPLING_RATE
from identification.studies.reproduction.figure_check import (
    CHECK_DEFAULTS,
    DOUBT,
    ERRATUM,
    HOLDS,
    CheckSettings,
    FigureCheck,
)

PRINTED_PERMEABILITY = 4 * math.pi * 1e7
"""Permeability of vacuum in Table 5 [V s/(A m)]."""

PRINTED_SIGNALS = ("I", "U", "p2", "p2", "p3")
"""'five acquired signals that are as follows' (section 3)."""


def parameter_checks(settings: CheckSettings = CHECK_DEFAULTS) -> list[FigureCheck]:
    """All checks of sections 5.1, 6 and of counts in the text."""
    return [
        _permeability(),
        _domains(),
        _candidates(),
        _retained(),
        *(_position(symbol, settings) for symbol in confidence_intervals()),
        _degrees_of_freedom(settings),
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


def _domains() -> FigureCheck:
    rows = [(row.value, row.domain) for row in table().values() if row.source in ("Table 6", "Table 7")]
    outside = [value for value, domain in rows if domain and not domain[0] <= value <= domain[1]]
    return FigureCheck(
        where="Tables 6 and 7, values within their expected domains",
        printed=f"{len(rows)} values",
        recomputed=f"{len(outside)} outside",
        status=ERRATUM if outside else HOLDS,
    )


def _candidates() -> FigureCheck:
    count = sum(row.source == "Table 7" for row in table().values())
    return FigureCheck(
        where="Section 5.1.3, candidate parameters",
        printed="7",
        recomputed=f"{count}",
        status=HOLDS if count == 7 else ERRATUM,
        remark="rows of Table 7",
    )


def _retained() -> FigureCheck:
    unknown = [row for row in table().values() if row.source == "Table 7"]
    kept = [row.symbol for row in unknown if row.sensitive]
    fits = set(confidence_intervals()) == {*kept, "R"} and len(unknown) - len(kept) == 4
    return FigureCheck(
        where="Section 5.2.2, parameters retained",
        printed="3 of Table 9, 4 removed, with R 4 to be estimated",
        recomputed=f"{len(kept)} ({', '.join(kept)}), {len(unknown) - len(kept)} removed",
        status=HOLDS if fits else ERRATUM,
    )


def interval_position(symbol: str) -> float:
    """Position of Table 12's estimate in Table 14's interval [-]: 0 at the lower end, 1 at the upper."""
    low, high = confidence_intervals()[symbol]
    return (Parameters.calibrated()[symbol] - low) / (high - low)


def _position(symbol: str, settings: CheckSettings) -> FigureCheck:
    position, (low, high) = interval_position(symbol), confidence_intervals()[symbol]
    least, most = settings.central_positions
    return FigureCheck(
        where=f"Tables 12 and 14, {symbol} in its 95 % interval",
        printed=f"{Parameters.calibrated()[symbol]:.7g} in [{low:.7g}, {high:.7g}]",
        recomputed=f"at {100 * position:.1f} % of the interval",
        status=HOLDS if least <= position <= most else DOUBT,
        remark="about 50 % at a smooth minimum: the interval reaches "
        f"{position / (1 - position):.0f} times as far down as up",
    )


def _degrees_of_freedom(settings: CheckSettings) -> FigureCheck:
    k, v = measurement_points(), len(confidence_intervals())
    quantile = float(stats.f.ppf(settings.confidence, v, k - v))
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
