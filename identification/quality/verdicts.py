"""A finding per channel and check: good, doubt or bad, with the figures and what to do."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from identification.quality.assess import Quality
from identification.quality.channel import Channel
from identification.quality.levels import SEVERITY, Judgement
from identification.quality.noise_checks import correlation, normality, whiteness
from identification.quality.reading_checks import noise, offset, outliers, resolution, trend
from identification.report.page import Verdict

CHECKS: Mapping[str, Callable[[Quality, Channel], Judgement]] = {
    "offset": offset,
    "trend": trend,
    "noise": noise,
    "resolution": resolution,
    "outliers": outliers,
    "normality": normality,
    "whiteness": whiteness,
    "correlation": correlation,
}
"""The checks by name; together they pass a perfect bench in 99 % of records or more."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One check of one channel."""

    channel: str
    check: str
    """One of CHECKS."""
    status: str
    """'good', 'doubt' or 'bad'; 'note' if it could not be judged."""
    text: str
    """One sentence: the figures and, unless good, what to do."""


def findings(quality: Quality, name: str) -> tuple[Finding, ...]:
    """All checks of one channel; of one that never changes, only its offset and its resolution."""
    channel = quality.channels[name]
    checks = CHECKS if channel.whiteness else {"offset": offset, "resolution": resolution}
    judged = {check: judge(quality, channel) for check, judge in checks.items()}
    return tuple(
        Finding(channel=name, check=check, status=judgement.status, text=judgement.text)
        for check, judgement in judged.items()
    )


def worst(found: Sequence[Finding]) -> str:
    """Worst status among some findings."""
    return max((finding.status for finding in found), key=SEVERITY.index)


def verdict(quality: Quality, name: str) -> Verdict:
    """One channel's verdict: what is not good about it, or its figures if all is."""
    found = {finding.check: finding for finding in findings(quality, name)}
    status = worst(tuple(found.values()))
    if status == "good":
        text = f"no fault found; {found['offset'].text}; {found['noise'].text}."
    else:
        faults = [finding for finding in found.values() if finding.status in ("doubt", "bad")]
        text = " ".join(f"{finding.check}: {finding.text}." for finding in faults)
    return Verdict(status=status, text=f"{name}: {text}")
