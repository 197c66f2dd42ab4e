"""An assessment as JSON-ready data and as text for a terminal."""

import math
from dataclasses import asdict
from typing import Any

from identification.quality.assessment import QualityAssessment, sensor_offsets
from identification.quality.channel import ChannelAssessment
from identification.quality.verdicts import CHECKS, check_results, worst_status
from identification.recordings.recording import CHANNELS


def as_json(quality: QualityAssessment) -> dict[str, Any]:
    """Figures in A, V and bar (sensor_offsets in SI units) and findings; None for what is undefined."""
    return {
        "recording": quality.name,
        "samples": quality.samples,
        "period_s": quality.period,
        "at_rest": quality.at_rest,
        "sensor_offsets_SI": {n: _finite(asdict(o)) for n, o in sensor_offsets(quality).items()},
        "channels": {name: _channel(quality, name) for name in CHANNELS},
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


def as_text(quality: QualityAssessment) -> str:
    """A line per channel: its worst status, then the status of each check."""
    widths = {check: max(len(check), 5) for check in CHECKS}
    lines = ["channel  verdict  " + "  ".join(check.ljust(widths[check]) for check in CHECKS)]
    for name in CHANNELS:
        statuses = {result.check: result.status for result in check_results(quality, name)}
        cells = "  ".join(statuses.get(check, "-").ljust(width) for check, width in widths.items())
        lines.append(f"{name:7}  {worst_status(check_results(quality, name)):7}  {cells}")
    return "\n".join(line.rstrip() for line in lines)


def _channel(quality: QualityAssessment, name: str) -> dict[str, Any]:
    channel = quality.channels[name]
    results = check_results(quality, name)
    return {
        "unit": channel.unit,
        "status": worst_status(results),
        "findings": [
            {"check": result.check, "status": result.status, "text": result.text} for result in results
        ],
        "trend": _finite(asdict(channel.trend)),
        "statistics": _finite(asdict(channel.description)),
        "normality": _finite(asdict(channel.normality)),
        "offset": channel.offset,
        "quantum": channel.quantum,
        "whiteness": _whiteness(channel),
    }


def _whiteness(channel: ChannelAssessment) -> dict[str, float] | None:
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
