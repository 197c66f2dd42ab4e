"""The quality of one recording: a verdict per channel and check, tables, the readings, and JSON."""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, fields
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from identification.quality.assessment import QualityAssessment, sensor_offsets, white_noise_band
from identification.quality.channel import DRIFT_LEVELS, ChannelAssessment, DescriptiveStatistics
from identification.recordings.recording import CHANNELS, PRESSURES, UNITS
from identification.report.page import Picture, Section, Table, Verdict, over_time

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


NOISE_LEVELS = (1.5, 4.0)
"""Standard deviation relative to Table 3's: 3.5 dB and 12 dB of its signal-to-noise ratio."""
QUIET_LEVELS = (5.0, 30.0)
"""Table 3's standard deviation relative to the record's, from which the noise is too small for a
sensor of this kind: a reading 100 times too small is as quiet."""
COARSE_STEP = 1.1
"""Converter step relative to Table 1's twelve bits from which the converter is too coarse."""
SEVERITY = ("note", "good", "doubt", "bad")
"""Statuses from harmless to worst; a note says that something could not be judged."""


class Judgement(NamedTuple):
    """What one check says."""

    status: str
    """One of SEVERITY."""
    text: str
    """One sentence: the figures and, unless good, what to do."""


def _graded(value: float, levels: tuple[float, float]) -> str:
    """Good below the first level, bad from the second on, in doubt between."""
    return SEVERITY[1 + sum(value >= limit for limit in levels)]


def _judged(status: str, figures: str, advice: str) -> Judgement:
    """The figures and, unless all is well, what to do."""
    return Judgement(status, figures if status == "good" else f"{figures}; {advice}")


def _milli(channel: ChannelAssessment, value: float) -> str:
    """A small value in mA, mV or mbar."""
    return f"{1e3 * value:.3g} m{channel.unit}"


def check_offset(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    """Is the mean reading within Table 1's accuracy of the rest value?"""
    pressure = channel.name in PRESSURES
    if not (quality.vented if pressure else quality.coil_off):
        reason = "the chambers are not vented" if pressure else "the coil is on"
        mean = f"the mean reading is {channel.rest + channel.offset:.4g} {channel.unit}, but {reason}"
        return Judgement("note", f"{mean}, so no offset can be read off; record at rest for it")
    return _judged(
        "good" if abs(channel.offset) <= channel.sensor.margin else "bad",
        f"offset {_milli(channel, channel.offset)} against an accuracy of "
        f"±{_milli(channel, channel.sensor.margin)}",
        f"{'vent this chamber' if pressure else 'switch the coil off'} and record again, "
        "or have the sensor calibrated",
    )


def check_trend(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    """Is the drift over the record small against the accuracy?"""
    ratio = abs(channel.drift) / channel.sensor.margin
    return _judged(
        _graded(ratio, DRIFT_LEVELS),
        f"drift {_milli(channel, channel.drift)} in {channel.duration:.3g} s, "
        f"{100 * ratio:.2g} % of the accuracy",
        "let the bench settle, look for a leak or a warming sensor, and record again",
    )


def check_noise(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    """Is the noise as small as the report's, but not so small that the unit must be wrong?"""
    deviation = channel.description.standard_deviation
    ratio = deviation / channel.usual_noise
    quiet = _graded(1.0 / max(ratio, 1e-9), QUIET_LEVELS)
    if channel.dithered and quiet != "good":
        return Judgement(
            quiet,
            f"noise {_milli(channel, deviation)}, only {ratio:.2g} times the usual; check the unit "
            "and scaling of the channel, since a reading too small has noise too small",
        )
    return _judged(
        _graded(ratio, NOISE_LEVELS),
        f"noise {_milli(channel, deviation)}, {ratio:.2f} times the usual, "
        f"signal-to-noise ratio {channel.description.signal_to_noise:.1f} dB",
        "check shielding, ground and supply of the sensor",
    )


def check_resolution(quality: QualityAssessment, channel: ChannelAssessment) -> Judgement:
    """Do the readings move, in steps no coarser than Table 1's range in twelve bits?"""
    if not channel.moves:
        figures = f"every sample reads {channel.readings[0]:.6g} {channel.unit}"
        if not channel.quantum:
            return _judged("bad", figures, "check the sensor's cable and the acquisition")
        return _judged(
            "doubt",
            f"{figures}, in steps of {_milli(channel, channel.quantum)}, which may hide the noise "
            "of a live sensor",
            "record with finer steps, since a dead sensor would read the same",
        )
    if run := channel.stands_still:
        still, allowed = (1e3 * quality.period * samples for samples in run)
        return _judged(
            "bad",
            f"one reading lasts {still:.3g} ms, where independent noise stays below {allowed:.3g} ms",
            "check the sensor's cable, its range and the acquisition",
        )
    ratio = channel.quantum / channel.sensor.resolution
    steps = channel.description.standard_deviation / channel.quantum if channel.quantum else np.inf
    return _judged(
        "doubt" if ratio > COARSE_STEP or not channel.dithered else "good",
        f"one step is {_milli(channel, channel.quantum)}, {ratio:.2f} times the usual range in 12 "
        f"bits, and the noise is {steps:.2g} steps",
        "check the converter's range and bits, since rounding errors do not average out",
    )


CHECKS: Mapping[str, Callable[[QualityAssessment, ChannelAssessment], Judgement]] = {
    "offset": check_offset,
    "trend": check_trend,
    "noise": check_noise,
    "resolution": check_resolution,
}
"""The checks by name; together they pass a perfect bench in 99 % of records or more."""


def check_results(quality: QualityAssessment, name: str) -> dict[str, Judgement]:
    """All checks of one channel; of one that never changes, only its offset and its resolution."""
    channel = quality.channels[name]
    checks = CHECKS if channel.moves else {"offset": check_offset, "resolution": check_resolution}
    return {check: judge(quality, channel) for check, judge in checks.items()}


def worst_status(results: Mapping[str, Judgement]) -> str:
    """Worst status among some results."""
    return max((result.status for result in results.values()), key=SEVERITY.index)


def channel_verdict(quality: QualityAssessment, name: str) -> Verdict:
    """One channel's verdict: what is not good about it, or its figures if all is."""
    results = check_results(quality, name)
    status = worst_status(results)
    if status == "good":
        text = f"no fault found; {results['offset'].text}; {results['noise'].text}."
    else:
        faults = {c: result.text for c, result in results.items() if result.status in ("doubt", "bad")}
        text = " ".join(f"{check}: {fault}." for check, fault in faults.items())
    return Verdict(status=status, text=f"{name}: {text}")
