"""The quality of one recording in a report: verdicts, tables, figures, and JSON."""

import math
from dataclasses import asdict, fields
from typing import Any

from identification.quality import figures as figures
from identification.quality.assessment import QualityAssessment, sensor_offsets
from identification.quality.channel import ChannelAssessment, DescriptiveStatistics
from identification.quality.noise_tests import white_noise_band
from identification.quality.verdicts import CHECKS, channel_verdict, check_results, worst_status
from identification.recordings.recording import CHANNELS, UNITS
from identification.report.page import Picture, Section, Table, Text

UNTESTED = "–"
"""Stands where a check does not apply."""

UNIT_COLUMNS = [f"{name} [{UNITS[name][0]}]" for name in CHANNELS]
"""Headings of a table with a column per channel."""


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
"""Names by field of DescriptiveStatistics."""


def quality_section(quality: QualityAssessment) -> Section:
    """Everything that is shown of a recording's quality."""
    return Section(
        title=f"Data quality: {quality.name} ({quality.samples} samples)",
        verdicts=[channel_verdict(quality, name) for name in CHANNELS],
        blocks=[
            _checks(quality),
            Text(text=_state(quality)),
            _trends(quality),
            _statistics(quality),
            _correlations(quality),
            *(Picture(figure=draw(quality), caption=text) for draw, text in figures.CAPTIONS.items()),
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
        [name, worst_status(own), *(own[c].status if c in own else UNTESTED for c in CHECKS)]
        for name, own in results.items()
    ]
    return Table(columns=["Channel", "verdict", *CHECKS], rows=rows, caption="Status of every check.")


def _trends(quality: QualityAssessment) -> Table:
    trends = [quality.channels[name].trend for name in CHANNELS]
    slopes = [_estimate(trend.factor, trend.factor_error) for trend in trends]
    offsets = [_estimate(trend.offset, trend.offset_error) for trend in trends]
    rows = [["factor [unit/s]", *slopes], ["offset [unit]", *offsets]]
    return Table(
        columns=["Parameter", *UNIT_COLUMNS],
        rows=rows,
        caption="Signal offset and trend check, ± one standard error.",
    )


def _estimate(value: float, error: float) -> str:
    return f"{value:z.6f} ± {error:.6f}" if math.isfinite(error) else f"{value:z.6f}"


def _statistics(quality: QualityAssessment) -> Table:
    statistics = {name: channel.description for name, channel in quality.channels.items()}
    rows = []
    for field in fields(DescriptiveStatistics):
        label = STATISTIC_NAMES[field.name]
        rows.append([label, *(_cell(statistics[name], field.name) for name in CHANNELS)])
    return Table(
        columns=["Parameter", *UNIT_COLUMNS],
        rows=rows,
        caption="Central, dispersion and distribution properties of the detrended signals.",
    )


def _cell(description: DescriptiveStatistics, name: str) -> str:
    value = getattr(description, name)
    if not math.isfinite(value):
        return "–"
    return f"{value:.2f}" if name == "signal_to_noise" else f"{value:z.4f}"


def _correlations(quality: QualityAssessment) -> Table:
    rows = [
        [
            f"{first}, {second}",
            f"{pair.correlation:.4f}",
            f"{quality.adjusted[first, second]:.2g}",
            f"{pair.peak:.4f}",
            f"{1e3 * quality.period * pair.peak_lag:.3g}",
        ]
        for (first, second), pair in quality.pairs.items()
    ]
    columns = ["Pair", "correlation", "p, family-wise", "greatest", "at lag [ms]"]
    caption = (
        f"Correlation of the detrended signals. Independent white signals lie within "
        f"±{white_noise_band(quality.samples):.4f} in 95 % of cases."
    )
    return Table(columns=columns, rows=rows, caption=caption)


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
