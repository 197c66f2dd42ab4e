"""The first screen of the report: the calibrated values, what they mean, whether to trust them."""

from collections.abc import Sequence
from dataclasses import dataclass

from epv_env.plant.parameters import table
from identification.calibration.calibrate import EXPLAINED, inseparable_symbols, symbols_on_bounds
from identification.confidence.section import PRECISE
from identification.pipeline.identification import ESTIMATOR, Identification
from identification.report.page import ANSWERS, Section, Table, Verdict
from identification.report_2003 import ACCEPTED_ERROR

ADVICE = {
    "good": "The model with these values holds on recordings that were not fitted to",
    "doubt": "Use these values with care",
    "bad": "Do not use these values",
}
"""What to do with the values, by the status of what concerns them all."""


@dataclass(frozen=True, kw_only=True)
class Reason:
    """One reason to doubt a value, or not to use it."""

    status: str
    """'doubt' or 'bad'."""
    text: str
    """Part of a sentence."""


@dataclass(frozen=True, kw_only=True)
class Trust:
    """Judgement of one calibrated value."""

    symbol: str
    reasons: Sequence[Reason]

    @property
    def status(self) -> str:
        """'good', 'doubt' or 'bad': the worst of the reasons."""
        return worst(self.reasons)


def worst(reasons: Sequence[Reason]) -> str:
    """The worst status of the reasons: 'good' without any."""
    statuses = {reason.status for reason in reasons}
    return next((status for status in ("bad", "doubt") if status in statuses), "good")


def common_reasons(identification: Identification) -> list[Reason]:
    """What speaks against all values alike: the search, and the model on held-out recordings."""
    reasons = []
    if not identification.calibration.best(ESTIMATOR).converged:
        reasons.append(Reason(status="bad", text="the search has not converged"))
    return [*reasons, *_held_out(identification)]


def judge_values(identification: Identification) -> list[Trust]:
    """The judgement of each calibrated value from what speaks against it alone."""
    calibration, confidence = identification.calibration, identification.confidence
    best = calibration.best(ESTIMATOR)
    at_ends = symbols_on_bounds(calibration.problem, best)
    inseparable, _ = inseparable_symbols(calibration.problem, best)
    relative = confidence.half_widths / confidence.estimate
    found = []
    for symbol, width in zip(calibration.problem.vector.symbols, relative, strict=True):
        reasons = []
        if symbol in at_ends:
            reasons.append(Reason(status="bad", text="at an end of its domain"))
        if symbol in inseparable:
            others = ", ".join(other for other in inseparable if other != symbol)
            text = f"these recordings cannot separate it from {others or 'the others'}"
            reasons.append(Reason(status="doubt", text=text))
        if width >= PRECISE:
            reasons.append(Reason(status="doubt", text=f"its interval is wide, ±{100 * width:.2g} %"))
        found.append(Trust(symbol=symbol, reasons=reasons))
    return found


def _held_out(identification: Identification) -> list[Reason]:
    if not identification.campaign.with_role("validation"):
        return [Reason(status="doubt", text="no recording was held out to check the model on")]
    validation = identification.validation
    if validation.worst >= ACCEPTED_ERROR:
        text = (
            f"the model misses held-out recordings by {100 * validation.worst:.3g} %, where "
            f"{100 * ACCEPTED_ERROR:.0f} % is the limit"
        )
        return [Reason(status="bad", text=text)]
    most = max(validation.residuals, key=lambda residual: residual.rms)
    if most.rms <= EXPLAINED:
        return []
    text = (
        f"the model lacks something that the values absorb: held-out {most.output} is missed by "
        f"{most.rms:.3g} times the noise; the command at the end finds out what"
    )
    return [Reason(status="doubt", text=text)]


def summary_section(identification: Identification) -> Section:
    """The calibrated values with their meaning, their 95 % intervals and whether to trust them."""
    common = common_reasons(identification)
    status, reasons = worst(common), "; ".join(reason.text for reason in common)
    text = f"{ADVICE[status]}{': ' if reasons else ''}{reasons}."
    return Section(
        title="Calibrated values",
        summary=True,
        verdicts=[Verdict(status=status, text=text)],
        blocks=[_values(identification, common, judge_values(identification))],
    )


def _values(identification: Identification, common: Sequence[Reason], judged: Sequence[Trust]) -> Table:
    intervals = identification.confidence.intervals()
    rows, statuses = [], []
    for trust in judged:
        row, value = table()[trust.symbol], identification.parameters[trust.symbol]
        low, high = intervals[trust.symbol]
        unit = "" if row.unit == "1" else f" {row.unit}"
        status = worst([*common, *trust.reasons])
        why = "; ".join(reason.text for reason in trust.reasons)
        rows.append(
            [
                f"{row.meaning} ({trust.symbol})",
                f"{value:.5g} ({low:.5g} to {high:.5g}){unit}",
                f"{ANSWERS[status]}{': ' if why else ''}{why}",
            ]
        )
        statuses.append(status)
    return Table(
        columns=["Parameter", "value (95 % interval)", "trust it"],
        rows=rows,
        statuses=statuses,
        caption="MV: magnet valve; PV: protection valve. Intervals hold the sensors' noise, not what "
        "the model lacks.",
    )
