"""What the report found on its own bench (Tables 2, 3, 4), in A, V and bar."""

from itertools import combinations

from identification.quality.statistics import DescriptiveStatistics
from identification.report_2003.printed_values import correlation_matrix

REPORT_CHANNELS = ("I", "U", "p1", "p2", "p3")
"""Channels of the report's bench, in the order of Table 1."""

STATISTIC_NAMES = {
    "arithmetic_mean": "arithmetic mean",
    "trimmed_mean": "trimmed mean [by 5 %]",
    "median": "median",
    "standard_deviation": "standard deviation",
    "interquartile_range": "interquartile range",
    "absolute_deviation": "absolute deviation",
    "range": "range",
    "signal_to_noise": "SNR [dB]",
    "outlier_factor": "outlier factor",
    "kurtosis": "kurtosis",
    "skewness": "skewness",
}
"""Rows of Table 3, by field of DescriptiveStatistics."""

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
    name: DescriptiveStatistics(**dict(zip(STATISTIC_NAMES, column, strict=True)))
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
