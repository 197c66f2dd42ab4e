"""Checks of the noise statistics: Tables 1 to 4 and sections 3 and 4."""

from itertools import combinations

import numpy as np
from scipy import stats

from docs.studies.reproduction.errata import CONFIDENCE, DOUBT, ERRATUM, HOLDS, FigureCheck
from epv_env.plant.channels import SENSORS
from identification.quality.channel import DescriptiveStatistics
from identification.recordings.recording import UNITS
from identification.report_2003 import correlation_matrix

REPORT_CHANNELS = ("I", "U", "p1", "p2", "p3")
"""Channels of the report's bench, in the order of Table 1."""

TREND_SLOPES = {"I": -6e-6, "U": 5.8e-5, "p1": 7.9e-5, "p2": -1.16e-4, "p3": -8.2e-5}
"""Table 2 [unit/s]."""

TREND_OFFSETS = {"I": -0.000235, "U": 0.001837, "p1": 1.000909, "p2": 0.99272, "p3": 0.996888}
"""Table 2 [unit]."""

_TABLE_3 = {
    "I": (0.0, 0.0, 0.0003, 0.0008, 0.001, 0.0006, 0.0049, 62.916, 3.513, 2.5794, 0.0825),
    "U": (0.0, -0.0001, -0.0009, 0.0122, 0.016, 0.0089, 0.0921, 66.953, 3.8362, 2.7138, 0.0972),
    "p1": (0.0, 0.0, 0.0007, 0.0068, 0.0074, 0.0055, 0.0507, 67.227, 3.7353, 3.052, 0.0583),
    "p2": (0.0, 0.0, 0.0017, 0.0098, 0.0093, 0.0078, 0.0733, 64.25, 3.9119, 3.1001, 0.0193),
    "p3": (0.0, 0.0, -0.0044, 0.0075, 0.0093, 0.0065, 0.0459, 66.995, 3.0882, 2.6351, 0.115),
}

STATISTICS = {
    name: DescriptiveStatistics(
        **dict(zip(DescriptiveStatistics.__dataclass_fields__, column, strict=True))
    )
    for name, column in _TABLE_3.items()
}
"""Table 3 by channel."""

CORRELATIONS = {
    (REPORT_CHANNELS[row], REPORT_CHANNELS[column]): correlation_matrix()[row][column]
    for row, column in combinations(range(len(REPORT_CHANNELS)), 2)
}
"""Table 4, above the diagonal."""

SAMPLES = 10_000
"""Of the report's record: 5 s at 2000 Hz."""

STANDARD_ERRORS = 3.0
"""Deviation of a statistic from its expected value that is still no doubt [standard errors]."""

PRINTED_HALF_DIGIT = 5e-5
"""Half the last digit of Table 3's standard deviations and ranges, which have four decimals [A, V or
bar]."""

CLAIMED_SIGNAL_TO_NOISE = 62.0
"""'over 62 dB in all cases' (section 4.1) [dB]."""


def noise_checks() -> list[FigureCheck]:
    """Checks of sections 3 and 4 that do not all hold."""
    return [
        *(_signal_to_noise(name) for name in REPORT_CHANNELS),
        _claimed_signal_to_noise(),
        *(_interquartile_range(name) for name in REPORT_CHANNELS),
        *(_median(name) for name in REPORT_CHANNELS),
        _kurtosis(),
        _skewness(),
        _sensor_range(),
        _correlations(),
    ]


def signal_to_noise(name: str, deviation: float) -> float:
    """Signal-to-noise ratio by eq. 17 with Table 1's greatest value [dB].

    name: channel. deviation: standard deviation of its noise [A, V or bar].
    """
    return float(20 * np.log10(SENSORS[name].high / deviation))


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
