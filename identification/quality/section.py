"""The quality of one recording in a report: verdicts, tables, the readings, and JSON."""

import math
from dataclasses import asdict, fields
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from identification.quality.assessment import QualityAssessment, sensor_offsets, white_noise_band
from identification.quality.channel import DescriptiveStatistics
from identification.quality.verdicts import channel_verdict, check_results, worst_status
from identification.recordings.recording import CHANNELS, UNITS
from identification.report.page import Picture, Section, Table
from identification.report.signals import over_time

UNIT_COLUMNS = [f"{name} [{UNITS[name][0]}]" for name in CHANNELS]
"""Headings of a table with a column per channel."""

OTHER_NAMES = {"trimmed_mean": "trimmed mean [by 5 %]", "signal_to_noise": "SNR [dB]"}
"""Of statistics that people call otherwise than their fields."""


def quality_section(quality: QualityAssessment) -> Section:
    """Everything that is shown of a recording's quality."""
    return Section(
        title=f"Data quality: {quality.name} ({quality.samples} samples)",
        verdicts=[channel_verdict(quality, name) for name in CHANNELS],
        blocks=[
            _state(quality),
            _trends(quality),
            _statistics(quality),
            _correlations(quality),
            Picture(figure=signals(quality), caption="Acquired data with its trend."),
        ],
    )


def signals(quality: QualityAssessment) -> Figure:
    """Readings over time, with the line of the trend (Figure 4)."""
    time = np.arange(quality.samples) * quality.period
    return over_time(
        time,
        {
            f"{channel.name} [{channel.unit}]": {
                "readings": channel.readings,
                "trend": channel.trend.intercept + channel.trend.slope * time,
            }
            for channel in quality.channels.values()
        },
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


def _trends(quality: QualityAssessment) -> Table:
    rows = []
    for title, value, error in (
        ("factor [unit/s]", "slope", "stderr"), ("offset [unit]", "intercept", "intercept_stderr")
    ):  # fmt: skip
        row = [title]
        for name in CHANNELS:
            trend = quality.channels[name].trend
            scatter = getattr(trend, error)
            shown = f" ± {scatter:.6f}" if math.isfinite(scatter) else ""
            row.append(f"{getattr(trend, value):z.6f}{shown}")
        rows.append(row)
    return Table(
        columns=["Parameter", *UNIT_COLUMNS],
        rows=rows,
        caption="Signal offset and trend check, ± one standard error.",
    )


def _statistics(quality: QualityAssessment) -> Table:
    rows = []
    for field in (each.name for each in fields(DescriptiveStatistics)):
        values = [getattr(quality.channels[name].description, field) for name in CHANNELS]
        digits = ".2f" if field == "signal_to_noise" else "z.4f"
        label = OTHER_NAMES.get(field, field.replace("_", " "))
        rows.append([label, *(format(v, digits) if math.isfinite(v) else "–" for v in values)])
    return Table(
        columns=["Parameter", *UNIT_COLUMNS],
        rows=rows,
        caption="Central, dispersion and distribution properties of the detrended signals.",
    )


def _correlations(quality: QualityAssessment) -> Table:
    caption = (
        f"Correlation of the detrended signals. Independent white signals lie within "
        f"±{white_noise_band(quality.samples):.4f} in 95 % of cases."
    )
    rows = [[", ".join(pair), f"{value:.4f}"] for pair, value in quality.correlations.items()]
    return Table(columns=["Pair", "correlation"], rows=rows, caption=caption)


def as_json(quality: QualityAssessment) -> dict[str, Any]:
    """Figures in A, V and bar (sensor_offsets in SI units) and findings; None for what is undefined."""
    channels = {}
    for name, channel in quality.channels.items():
        results, trend = check_results(quality, name), channel.trend
        line = {
            "factor": trend.slope, "factor_error": trend.stderr,
            "offset": trend.intercept, "offset_error": trend.intercept_stderr,
        }  # fmt: skip
        channels[name] = {
            "unit": channel.unit,
            "status": worst_status(results),
            "findings": [
                {"check": check, "status": result.status, "text": result.text}
                for check, result in results.items()
            ],
            "trend": _finite({key: float(value) for key, value in line.items()}),
            "statistics": _finite(asdict(channel.description)),
            "offset": channel.offset,
            "quantum": channel.quantum,
        }
    return {
        "recording": quality.name,
        "samples": quality.samples,
        "period_s": quality.period,
        "at_rest": quality.at_rest,
        "sensor_offsets_SI": {n: _finite(asdict(o)) for n, o in sensor_offsets(quality).items()},
        "channels": channels,
        "correlations": [
            {"channels": list(pair), "correlation": value}
            for pair, value in quality.correlations.items()
        ],
    }


def _finite(figures: dict[str, float]) -> dict[str, float | None]:
    return {name: value if math.isfinite(value) else None for name, value in figures.items()}
