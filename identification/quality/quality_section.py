"""Section 4 of the report for one recording: verdicts, Tables 2 to 4 and Figures 4 to 9."""

import math
from collections.abc import Mapping
from dataclasses import fields

from identification.quality import printed_statistics as reported
from identification.quality import quality_figures as figures
from identification.quality.assessment import QualityAssessment, sensor_offsets
from identification.quality.correlation_tests import white_noise_band
from identification.quality.statistics import DescriptiveStatistics
from identification.quality.verdicts import CHECKS, channel_verdict, check_results, worst_status
from identification.recordings.recording import CHANNELS, UNITS
from identification.report.page import Picture, Section, Table, Text

NOT_PRINTED = "–"
"""Stands where the report has no value."""

UNIT_COLUMNS = [f"{name} [{UNITS[name][0]}]" for name in CHANNELS]
"""Headings of a table with a column per channel."""


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
    rows = []
    for name in CHANNELS:
        statuses = {result.check: result.status for result in check_results(quality, name)}
        rows.append(
            [
                name,
                worst_status(check_results(quality, name)),
                *(statuses.get(check, "–") for check in CHECKS),
            ]
        )
    return Table(columns=["Channel", "verdict", *CHECKS], rows=rows, caption="Status of every check.")


def _trends(quality: QualityAssessment, report_2003: bool) -> Table:
    trends = [quality.channels[name].trend for name in CHANNELS]
    slopes = [_estimate(trend.factor, trend.factor_error) for trend in trends]
    offsets = [_estimate(trend.offset, trend.offset_error) for trend in trends]
    rows = [["factor [unit/s]", *slopes], ["offset [unit]", *offsets]]
    if report_2003:
        rows.insert(1, ["  the report's", *_printed_trends(reported.TREND_SLOPES)])
        rows.append(["  the report's", *_printed_trends(reported.TREND_OFFSETS)])
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
    printed = reported.STATISTICS
    return [_cell(printed[name], field) if name in printed else NOT_PRINTED for name in CHANNELS]


def _estimate(value: float, error: float) -> str:
    return f"{value:z.6f} ± {error:.6f}" if math.isfinite(error) else f"{value:z.6f}"


def _statistics(quality: QualityAssessment, report_2003: bool) -> Table:
    statistics = {name: channel.description for name, channel in quality.channels.items()}
    rows = []
    for field in fields(DescriptiveStatistics):
        label = reported.STATISTIC_NAMES[field.name]
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
    printed = reported.CORRELATIONS.get((first, second))
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
