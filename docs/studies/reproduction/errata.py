"""Checks of the report's printed figures against each other: errata, doubts and what holds."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import stats

from epv_env.plant.channels import SENSORS
from epv_env.plant.parameters import Parameters, confidence_intervals, table
from identification.quality.section import (
    REPORT_CHANNELS,
    SAMPLES,
    STATISTICS,
    TREND_OFFSETS,
)
from identification.recordings.recording import OUTPUTS, UNITS
from identification.report_2003.cases import CALIBRATION_CASES, SAMPLING_RATE
from identification.report_2003.output_error import partial_error, total_error
from identification.report_2003.printed_values import (
    correlation_matrix,
    printed_errors,
    printed_sensitivities,
    printed_total,
)
from identification.sensitivity.one_at_a_time import FACTORS, THRESHOLD

HOLDS, ERRATUM, DOUBT = "holds", "slip", "doubt"
"""Values of `status` in reproduce.json.

HOLDS: the printed figures agree. ERRATUM: they contradict each other. DOUBT: they are hard to believe
together.
"""

ERROR_ROUNDING = 1.5e-4
"""Tolerance of a root of squares of errors that are printed to 1e-4 [%]."""
IMPROVEMENT_ROUNDING = 0.01
"""Tolerance of a relative fall of the total error [%], printed to two digits here."""
STANDARD_ERRORS = 3.0
"""Deviation of a statistic from its expected value that is still no doubt [standard errors]."""
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


def figure_checks() -> list[FigureCheck]:
    """All checks in the order of the report's sections, those that hold included."""
    return [*noise_checks(), *parameter_checks(), *error_table_checks()]


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


# Sections 3 and 4: noise statistics, Tables 1 to 4


PRINTED_HALF_DIGIT = 5e-5
"""Half the last digit of Table 3's standard deviations and ranges, which have four decimals [A, V or
bar]."""

PRINTED_DURATION, PRINTED_RATE, HIGHEST_CARD_RATE = 5.0, 2000.0, 2100.0
"""Duration [s] and rate [Hz] of the quality record, and highest rate of the acquisition
card [Hz] (sections 3 and 4)."""

CLAIMED_SIGNAL_TO_NOISE = 62.0
"""'over 62 dB in all cases' (section 4.1) [dB]."""


def noise_checks() -> list[FigureCheck]:
    """All checks of sections 3 and 4."""
    return [
        _samples(),
        *(_signal_to_noise(name) for name in REPORT_CHANNELS),
        _claimed_signal_to_noise(),
        *(_outlier_factor(name) for name in REPORT_CHANNELS),
        *(_interquartile_range(name) for name in REPORT_CHANNELS),
        *(_median(name) for name in REPORT_CHANNELS),
        _kurtosis(),
        _skewness(),
        _sensor_range(),
        _symmetry(),
        _correlations(),
    ]


def signal_to_noise(name: str, deviation: float) -> float:
    """Signal-to-noise ratio by eq. 17 with Table 1's greatest value [dB].

    name: channel. deviation: standard deviation of its noise [A, V or bar].
    """
    return float(20 * np.log10(SENSORS[name].high / deviation))


def _samples() -> FigureCheck:
    count = PRINTED_DURATION * PRINTED_RATE
    fits = count == SAMPLES and PRINTED_RATE <= HIGHEST_CARD_RATE
    return FigureCheck(
        where="Section 4, samples of the quality record",
        printed=f"{SAMPLES}",
        recomputed=f"{count:g}",
        status=HOLDS if fits else ERRATUM,
        remark="5 s at 2000 Hz, which the card allows (1 to 2100 Hz)",
    )


def _signal_to_noise(name: str) -> FigureCheck:
    """Printed SNR against what any standard deviation that rounds to the printed one can give."""
    deviation, printed = STATISTICS[name].standard_deviation, STATISTICS[name].signal_to_noise
    low, high = (
        signal_to_noise(name, deviation + change) for change in (PRINTED_HALF_DIGIT, -PRINTED_HALF_DIGIT)
    )
    unit, greatest = UNITS[name][0], deviation * 10 ** (printed / 20)
    return FigureCheck(
        where=f"Table 3, SNR of {name} [dB]",
        printed=f"{printed:.3f}",
        recomputed=f"{low:.3f} to {high:.3f}",
        status=HOLDS if low <= printed <= high else ERRATUM,
        remark=f"eq. 17 with Table 1's greatest value, {SENSORS[name].high:g} {unit}; the printed SNR "
        f"would take {greatest:.3g} {unit}",
    )


def _claimed_signal_to_noise() -> FigureCheck:
    found = {
        name: signal_to_noise(name, STATISTICS[name].standard_deviation) for name in REPORT_CHANNELS
    }
    least = min(found, key=lambda name: found[name])
    return FigureCheck(
        where="Section 4.1, SNR 'over 62 dB in all cases' [dB]",
        printed=f"over {CLAIMED_SIGNAL_TO_NOISE:g}",
        recomputed=f"{found[least]:.2f} ({least})",
        status=HOLDS if found[least] > CLAIMED_SIGNAL_TO_NOISE else ERRATUM,
        remark="eq. 17 with the printed standard deviations",
    )


def _outlier_factor(name: str) -> FigureCheck:
    """The farthest sample lies between half the range and the range from the mean."""
    row = STATISTICS[name]
    farthest = row.outlier_factor * row.standard_deviation
    slack = row.outlier_factor * PRINTED_HALF_DIGIT + PRINTED_HALF_DIGIT
    return FigureCheck(
        where=f"Table 3, outlier factor of {name}",
        printed=f"{row.outlier_factor:.4f}",
        recomputed=f"{row.range / 2 / row.standard_deviation:.2f} to "
        f"{row.range / row.standard_deviation:.2f}",
        status=HOLDS if row.range / 2 - slack <= farthest <= row.range + slack else ERRATUM,
        remark="eq. 18: half the range or more, over the standard deviation",
    )


def _interquartile_range(name: str) -> FigureCheck:
    """For normal noise 1.349 standard deviations, within one step of the converter."""
    row = STATISTICS[name]
    normal = float(2 * stats.norm.ppf(0.75)) * row.standard_deviation
    within = abs(normal - row.interquartile_range) <= SENSORS[name].resolution
    return FigureCheck(
        where=f"Table 3, interquartile range of {name} [{UNITS[name][0]}]",
        printed=f"{row.interquartile_range:.4f}",
        recomputed=f"{normal:.4f}",
        status=HOLDS if within else DOUBT,
        remark=f"normal noise, within one step of the converter ({SENSORS[name].resolution:.4f})",
    )


def _median(name: str) -> FigureCheck:
    """Of detrended, symmetric, rounded noise: within half a step and some standard errors of zero."""
    row = STATISTICS[name]
    error = np.sqrt(np.pi / 2 / SAMPLES) * row.standard_deviation
    half = SENSORS[name].resolution / 2 + STANDARD_ERRORS * float(error)
    return FigureCheck(
        where=f"Table 3, median of {name} [{UNITS[name][0]}]",
        printed=f"{row.median:.4f}",
        recomputed=f"within ±{half:.4f}",
        status=HOLDS if abs(row.median) <= half + PRINTED_HALF_DIGIT else DOUBT,
        remark=f"half a step of the converter at mean zero and skewness {row.skewness:g}; the printed "
        f"median is {abs(row.median) / row.standard_deviation:.2f} standard deviations off",
    )


def _kurtosis() -> FigureCheck:
    excess = {name: STATISTICS[name].kurtosis - 3 for name in REPORT_CHANNELS}
    return _beyond_normal("kurtosis", excess, np.sqrt(24 / SAMPLES))


def _skewness() -> FigureCheck:
    excess = {name: STATISTICS[name].skewness for name in REPORT_CHANNELS}
    return _beyond_normal("skewness", excess, np.sqrt(6 / SAMPLES))


def _beyond_normal(quantity: str, excess: dict[str, float], standard_error: float) -> FigureCheck:
    """Excess over normal noise's value by channel [-], against its standard error for normal noise."""
    limit = STANDARD_ERRORS
    far = {
        n: value / standard_error for n, value in excess.items() if abs(value) > limit * standard_error
    }
    return FigureCheck(
        where=f"Table 3, {quantity} 'close to' that of normal noise",
        printed="all channels",
        recomputed=", ".join(f"{name} {value:+.1f}" for name, value in far.items()) or "none",
        status=DOUBT if far else HOLDS,
        remark=f"deviations of more than {limit:g} standard errors, in standard errors "
        f"({standard_error:.3f} each)",
    )


def _sensor_range() -> FigureCheck:
    outside = [name for name in REPORT_CHANNELS if TREND_OFFSETS[name] < SENSORS[name].low]
    return FigureCheck(
        where="Table 2 against Table 1, pressures at rest [bar]",
        printed=", ".join(f"{name} {TREND_OFFSETS[name]:.4f}" for name in outside) or "inside",
        recomputed=f"at least {SENSORS['p2'].low:g}",
        status=DOUBT if outside else HOLDS,
        remark="the record at ambient pressure lies at and below the lower end of the sensors' range",
    )


def _symmetry() -> FigureCheck:
    matrix = np.array(correlation_matrix())
    symmetric = bool(np.all(matrix == matrix.T)) and bool(np.all(np.diag(matrix) == 1))
    return FigureCheck(
        where="Table 4, symmetry and unit diagonal",
        printed="symmetric",
        recomputed="symmetric" if symmetric else "not symmetric",
        status=HOLDS if symmetric else ERRATUM,
    )


def _correlations() -> FigureCheck:
    matrix = np.array(correlation_matrix())
    band = float(stats.norm.ppf(0.5 + CONFIDENCE / 2) / np.sqrt(SAMPLES))
    pairs = [(i, j) for i in range(len(REPORT_CHANNELS)) for j in range(i) if abs(matrix[i, j]) > band]
    return FigureCheck(
        where="Table 4, 'shows non-correlated data'",
        printed="no pair correlated",
        recomputed=f"{len(pairs)} of 10 pairs beyond ±{band:.4f}: "
        + ", ".join(f"{REPORT_CHANNELS[j]}-{REPORT_CHANNELS[i]} {matrix[i, j]:+.4f}" for i, j in pairs),
        status=ERRATUM if len(pairs) > 1 else HOLDS,
        remark=f"95 % band of independent white signals of {SAMPLES} samples; 1 in 20 may lie outside",
    )


# Sections 5.1 and 6: parameters, eq. 23 and counts in the text


PRINTED_PERMEABILITY = 4 * math.pi * 1e7
"""Permeability of vacuum in Table 5 [V s/(A m)]."""

PRINTED_SIGNALS = ("I", "U", "p2", "p2", "p3")
"""'five acquired signals that are as follows' (section 3)."""


def parameter_checks() -> list[FigureCheck]:
    """All checks of sections 5.1, 6 and of counts in the text."""
    return [
        _permeability(),
        _domains(),
        _candidates(),
        _retained(),
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


# Tables 8, 9, 11, 13 and 15


ACCEPTED_TOTAL_ERROR = 10.0
"""Total error that the report accepts (section 2.2) [%]."""


def recomputed_partial(errors: Mapping[str, float]) -> float:
    """Partial error by eq. 20 [%] from the printed errors of the outputs [%]."""
    return float(partial_error([np.array(errors[name]) for name in OUTPUTS]))


def recomputed_total(number: int) -> float:
    """Total error by eq. 21 [%] from the printed partial errors of Table 11 or 13."""
    return float(total_error([np.array(test["partial"]) for test in printed_errors(number).values()]))


def error_table_checks() -> list[FigureCheck]:
    """All checks of the error tables."""
    return [
        *_partial_errors(),
        *(_total_error(number) for number in (11, 13)),
        _improvement(),
        _first_test_p2(),
        _accepted_total_errors(),
        _sensitivity_classes(),
        _a1_sensitivity(),
    ]


def _partial_errors() -> list[FigureCheck]:
    return [
        numeric_check(
            f"Table {number}, {name}, partial error [%]",
            errors["partial"],
            recomputed_partial(errors),
            ERROR_ROUNDING,
            remark="eq. 20",
        )
        for number in (11, 13, 15)
        for name, errors in printed_errors(number).items()
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


def _accepted_total_errors() -> FigureCheck:
    found = (recomputed_total(11), recomputed_total(13), printed_errors(15)["Validation"]["partial"])
    return FigureCheck(
        where="Sections 6.1, 6.2 and 7, total error below the tolerance [%]",
        printed=f"below {ACCEPTED_TOTAL_ERROR:g}",
        recomputed=", ".join(f"{value:.4f}" for value in found),
        status=HOLDS if max(found) < ACCEPTED_TOTAL_ERROR else ERRATUM,
        remark="also with the corrected total of Table 13",
    )


def _sensitivity_classes() -> FigureCheck:
    printed = {**printed_sensitivities(8), **printed_sensitivities(9)}
    wrong = [s for s, pair in printed.items() if (max(pair) >= 100 * THRESHOLD) != table()[s].sensitive]
    return FigureCheck(
        where="Tables 8 and 9, classes",
        printed=f"{sum(table()[s].sensitive for s in printed)} of {len(printed)} Sensitive",
        recomputed=f"{len(wrong)} classes differ",
        status=ERRATUM if wrong else HOLDS,
        remark="Sensitive: a total error of 2 % or more in either direction (section 5.2.2)",
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
