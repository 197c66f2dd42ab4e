"""One printed figure of the report, checked against the report's other figures."""

from dataclasses import dataclass

HOLDS, ERRATUM, DOUBT = "holds", "slip", "doubt"
"""Values of `status` in reproduce.json.

HOLDS: the printed figures agree. ERRATUM: they contradict each other. DOUBT: they are hard to believe
together.
"""

STATUS_LABELS = {ERRATUM: "erratum", DOUBT: "doubt", HOLDS: "holds"}
"""Status as the HTML report shows it, in the order of its table."""


@dataclass(frozen=True, kw_only=True)
class CheckSettings:
    """What the checks of the printed figures accept."""

    error_rounding: float = 1.5e-4
    """Tolerance of a root of squares of errors that are printed to 1e-4 [%]."""
    improvement_rounding: float = 0.01
    """Tolerance of a relative fall of the total error [%], printed to two digits here."""
    standard_errors: float = 3.0
    """Deviation of a statistic from its expected value that is still no doubt [standard errors]."""
    confidence: float = 0.95
    """Confidence of the band of a correlation, and probability of the F quantile of eq. 23 [-]."""
    central_positions: tuple[float, float] = (0.25, 0.75)
    """Positions of an estimate in its confidence interval, from 0 at the lower to 1 at the upper end,
    that are no doubt."""


CHECK_DEFAULTS = CheckSettings()


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
