"""Section 4 of the report for one recording: verdicts, Tables 2 to 4, Figures 4 to 9, and JSON."""

import math
from collections.abc import Mapping
from dataclasses import asdict, fields
from itertools import combinations
from typing import Any

from identification.quality import figures as figures
from identification.quality.assessment import QualityAssessment, sensor_offsets
from identification.quality.channel import ChannelAssessment, DescriptiveStatistics
from identification.quality.noise_tests import white_noise_band
from identification.quality.verdicts import CHECKS, channel_verdict, check_results, worst_status
from identification.recordings.recording import CHANNELS, UNITS
from identification.report.page import Picture, Section, Table, Text
from identification.report_2003 import correlation_matrix

NOT_PRINTED = "–"
"""Stands where the report has no value."""

UNIT_COLUMNS = [f"{name} [{UNITS[name][0]}]" for name in CHANNELS]
"""Headings of a table with a column per channel."""


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


def quality_section(quality: QualityAssessment, *, report_2003: bool = False) -> Section:
    """Everything that section 4 shows; report_2003: beside the report's values."""
    return Section(
        title=f"Data quality: {quality.name} ({quality.samples} samples)",
        printed="section 4",
        verdicts=[channel_verdict(quality, name) for name in CHANNELS],
        blocks=[
            _checks(quality),
            Text(text=_state(quality)),
            _trends(quality, report_2003),
            _statistics(quality, report_2003),
            _correlations(quality, report_2003),
            *_pictures(quality),
        ],
    )


def _state(quality: QualityAssessment) -> str:
    if quality.at_rest:
        values = ", ".join(
            f"{name} {offset.value:.3g}" for name, offset in sensor_offsets(quality).items()
        )
        return f"The record is at rest. A calibration may subtract these offsets [A, V, Pa]: {values}."
    off = [name for name, channel in quality.channels.items() if not channel.at_rest]
    return (
        f"Not at rest or not steady: {', '.join(off)}. The limits are the sensors' accuracy about 0 A, "
        "0 V and p_env, and a tenth of it for a drift. A calibration subtracts no offsets."
    )


def _checks(quality: QualityAssessment) -> Table:
    results = {name: check_results(quality, name) for name in CHANNELS}
    rows = [
        [name, worst_status(own), *(own[c].status if c in own else NOT_PRINTED for c in CHECKS)]
        for name, own in results.items()
    ]
    return Table(columns=["Channel", "verdict", *CHECKS], rows=rows, caption="Status of every check.")


def _trends(quality: QualityAssessment, report_2003: bool) -> Table:
    trends = [quality.channels[name].trend for name in CHANNELS]
    slopes = [_estimate(trend.factor, trend.factor_error) for trend in trends]
    offsets = [_estimate(trend.offset, trend.offset_error) for trend in trends]
    rows = [["factor [unit/s]", *slopes], ["offset [unit]", *offsets]]
    if report_2003:
        rows.insert(1, ["  the report's", *_printed_trends(TREND_SLOPES)])
        rows.append(["  the report's", *_printed_trends(TREND_OFFSETS)])
    return Table(
        columns=["Parameter", *UNIT_COLUMNS],
        rows=rows,
        caption="Signal offset and trend check, ± one standard error.",
        printed="Table 2",
    )


def _printed_trends(values: Mapping[str, float]) -> list[str]:
    """The report's value for each channel, NOT_PRINTED for one that its bench does not have."""
    return [f"{values[name]:.6f}" if name in values else NOT_PRINTED for name in CHANNELS]


def _printed_statistics(field: str) -> list[str]:
    """A row of Table 3 for each channel."""
    printed = STATISTICS
    return [_cell(printed[name], field) if name in printed else NOT_PRINTED for name in CHANNELS]


def _estimate(value: float, error: float) -> str:
    return f"{value:z.6f} ± {error:.6f}" if math.isfinite(error) else f"{value:z.6f}"


def _statistics(quality: QualityAssessment, report_2003: bool) -> Table:
    statistics = {name: channel.description for name, channel in quality.channels.items()}
    rows = []
    for field in fields(DescriptiveStatistics):
        label = STATISTIC_NAMES[field.name]
        rows.append([label, *(_cell(statistics[name], field.name) for name in CHANNELS)])
        if report_2003:
            rows.append(["  the report's", *_printed_statistics(field.name)])
    return Table(
        columns=["Parameter", *UNIT_COLUMNS],
        rows=rows,
        caption="Central, dispersion and distribution properties of the detrended signals.",
        printed="Table 3",
    )


def _cell(description: DescriptiveStatistics, name: str) -> str:
    value = getattr(description, name)
    if not math.isfinite(value):
        return "–"
    return f"{value:.2f}" if name == "signal_to_noise" else f"{value:z.4f}"


def _printed_correlation(first: str, second: str) -> str:
    """The report's correlation of two channels (Table 4)."""
    printed = CORRELATIONS.get((first, second))
    return NOT_PRINTED if printed is None else f"{printed:.4f}"


def _correlations(quality: QualityAssessment, report_2003: bool) -> Table:
    rows = [
        [
            f"{first}, {second}",
            f"{pair.correlation:.4f}",
            f"{quality.adjusted[first, second]:.2g}",
            f"{pair.peak:.4f}",
            f"{1e3 * quality.period * pair.peak_lag:.3g}",
            *([_printed_correlation(first, second)] if report_2003 else []),
        ]
        for (first, second), pair in quality.pairs.items()
    ]
    columns = ["Pair", "correlation", "p, family-wise", "greatest", "at lag [ms]"]
    if report_2003:
        columns.append("the report's")
    caption = (
        f"Correlation of the detrended signals. Independent white signals lie within "
        f"±{white_noise_band(quality.samples):.4f} in 95 % of cases."
    )
    return Table(columns=columns, rows=rows, caption=caption, printed="Table 4")


def _pictures(quality: QualityAssessment) -> list[Picture]:
    return [
        Picture(figure=draw(quality), caption=text, printed=printed)
        for draw, (text, printed) in figures.CAPTIONS.items()
    ]


def as_json(quality: QualityAssessment) -> dict[str, Any]:
    """Figures in A, V and bar (sensor_offsets in SI units) and findings; None for what is undefined."""
    return {
        "recording": quality.name,
        "samples": quality.samples,
        "period_s": quality.period,
        "at_rest": quality.at_rest,
        "sensor_offsets_SI": {n: _finite(asdict(o)) for n, o in sensor_offsets(quality).items()},
        "channels": {name: _channel_json(quality, name) for name in CHANNELS},
        "correlations": [
            {
                "channels": list(names),
                "correlation": pair.correlation,
                "adjusted_p": quality.adjusted[names],
                "peak": pair.peak,
                "peak_lag_s": pair.peak_lag * quality.period,
            }
            for names, pair in quality.pairs.items()
        ],
    }


def _channel_json(quality: QualityAssessment, name: str) -> dict[str, Any]:
    channel = quality.channels[name]
    results = check_results(quality, name)
    return {
        "unit": channel.unit,
        "status": worst_status(results),
        "findings": [
            {"check": check, "status": result.status, "text": result.text}
            for check, result in results.items()
        ],
        "trend": _finite(asdict(channel.trend)),
        "statistics": _finite(asdict(channel.description)),
        "normality": _finite(asdict(channel.normality)),
        "offset": channel.offset,
        "quantum": channel.quantum,
        "whiteness": _whiteness_json(channel),
    }


def _whiteness_json(channel: ChannelAssessment) -> dict[str, float] | None:
    test = channel.whiteness
    if test is None:
        return None
    return {
        "ljung_box_p": test.probability,
        "greatest_autocorrelation": test.peak,
        "variance_inflation": test.inflation,
    }


def _finite(figures: dict[str, float]) -> dict[str, float | None]:
    return {name: value if math.isfinite(value) else None for name, value in figures.items()}
