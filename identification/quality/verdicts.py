"""A result per channel and check: good, doubt or bad, with the figures and what to do."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from identification.quality.assessment import QualityAssessment
from identification.quality.channel import ChannelAssessment
from identification.quality.judgements import SEVERITY, Judgement
from identification.quality.noise_checks import check_correlation, check_normality, check_whiteness
from identification.quality.reading_checks import (
    check_noise,
    check_offset,
    check_outliers,
    check_resolution,
    check_trend,
)
from identification.report.page import Verdict

CHECKS: Mapping[str, Callable[[QualityAssessment, ChannelAssessment], Judgement]] = {
    "offset": check_offset,
    "trend": check_trend,
    "noise": check_noise,
    "resolution": check_resolution,
    "outliers": check_outliers,
    "normality": check_normality,
    "whiteness": check_whiteness,
    "correlation": check_correlation,
}
"""The checks by name; together they pass a perfect bench in 99 % of records or more."""


@dataclass(frozen=True, kw_only=True)
class CheckResult:
    """One check of one channel."""

    channel: str
    """One of recording.CHANNELS."""
    check: str
    """One of CHECKS."""
    status: str
    """'good', 'doubt' or 'bad'; 'note' if it could not be judged."""
    text: str
    """One sentence: the figures and, unless good, what to do."""


def check_results(quality: QualityAssessment, name: str) -> tuple[CheckResult, ...]:
    """All checks of one channel; of one that never changes, only its offset and its resolution."""
    channel = quality.channels[name]
    checks = CHECKS if channel.whiteness else {"offset": check_offset, "resolution": check_resolution}
    judged = {check: judge(quality, channel) for check, judge in checks.items()}
    return tuple(
        CheckResult(channel=name, check=check, status=judgement.status, text=judgement.text)
        for check, judgement in judged.items()
    )


def worst_status(results: Sequence[CheckResult]) -> str:
    """Worst status among some results."""
    return max((result.status for result in results), key=SEVERITY.index)


def channel_verdict(quality: QualityAssessment, name: str) -> Verdict:
    """One channel's verdict: what is not good about it, or its figures if all is."""
    results = {result.check: result for result in check_results(quality, name)}
    status = worst_status(tuple(results.values()))
    if status == "good":
        text = f"no fault found; {results['offset'].text}; {results['noise'].text}."
    else:
        faults = [result for result in results.values() if result.status in ("doubt", "bad")]
        text = " ".join(f"{result.check}: {result.text}." for result in faults)
    return Verdict(status=status, text=f"{name}: {text}")
