"""The first screen of the report: the calibrated values, what they mean, whether to trust them."""

from collections.abc import Iterable

from epv_env.plant.parameters import table
from identification.calibration.calibrate import EXPLAINED, inseparable_symbols, symbols_on_bounds
from identification.confidence.confidence import PRECISE
from identification.pipeline.identification import ESTIMATOR, Identification
from identification.report.page import ANSWERS, Section, Table, Verdict
from identification.report_2003 import ACCEPTED_ERROR

ADVICE = {
    "good": "The model with these values holds on recordings that were not fitted to",
    "doubt": "Use these values with care",
    "bad": "Do not use these values",
}
"""What to do with the values, by the status of what concerns them all."""

Reasons = list[Verdict]
"""Reasons to doubt a value ('doubt'), or not to use it ('bad'); their texts are parts of a sentence."""


def worst(reasons: Iterable[Verdict]) -> str:
    """The worst status of the reasons: 'good' without any."""
    statuses = {reason.status for reason in reasons}
    return next((status for status in ("bad", "doubt") if status in statuses), "good")


def common_reasons(identification: Identification) -> Reasons:
    """What speaks against all values alike: the search, and the model on held-out recordings."""
    reasons = []
    if not identification.calibration.best(ESTIMATOR).converged:
        reasons.append(Verdict(status="bad", text="the search has not converged"))
    if not identification.campaign.with_role("validation"):
        text = "no recording was held out to check the model on"
        return [*reasons, Verdict(status="doubt", text=text)]
    validation = identification.validation
    most = max(validation.residuals, key=lambda residual: residual.rms)
    if validation.worst >= ACCEPTED_ERROR:
        text = (
            f"the model misses held-out recordings by {100 * validation.worst:.3g} %, where "
            f"{100 * ACCEPTED_ERROR:.0f} % is the limit"
        )
        reasons.append(Verdict(status="bad", text=text))
    elif most.rms > EXPLAINED:
        text = (
            f"the model lacks something that the values absorb: held-out {most.output} is missed by "
            f"{most.rms:.3g} times the noise; the next command finds out what"
        )
        reasons.append(Verdict(status="doubt", text=text))
    return reasons


def judge_values(identification: Identification) -> dict[str, Reasons]:
    """What speaks against each calibrated value alone, by symbol."""
    calibration, confidence = identification.calibration, identification.confidence
    best, symbols = calibration.best(ESTIMATOR), calibration.problem.vector.symbols
    inseparable, _ = inseparable_symbols(calibration.problem, best)
    relative = confidence.half_widths / confidence.estimate
    reasons: dict[str, Reasons] = {symbol: [] for symbol in symbols}
    for symbol in symbols_on_bounds(calibration.problem, best):
        reasons[symbol].append(Verdict(status="bad", text="at an end of its domain"))
    for symbol in inseparable:
        others = ", ".join(other for other in inseparable if other != symbol) or "the others"
        text = f"these recordings cannot separate it from {others}"
        reasons[symbol].append(Verdict(status="doubt", text=text))
    for symbol, width in zip(symbols, relative, strict=True):
        if width >= PRECISE:
            text = f"its interval is wide, ±{100 * width:.2g} %"
            reasons[symbol].append(Verdict(status="doubt", text=text))
    return reasons


def summary_section(identification: Identification) -> Section:
    """The calibrated values with their meaning, their 95 % intervals and whether to trust them."""
    common, intervals = common_reasons(identification), identification.confidence.intervals()
    text = ": ".join(filter(None, [ADVICE[worst(common)], "; ".join(r.text for r in common)]))
    rows, statuses = [], []
    for symbol, reasons in judge_values(identification).items():
        row, value = table()[symbol], identification.parameters[symbol]
        low, high = intervals[symbol]
        unit = "" if row.unit == "1" else f" {row.unit}"
        statuses.append(worst([*common, *reasons]))
        why = "; ".join(reason.text for reason in reasons) or "for the reason above"
        rows.append(
            [
                f"{row.meaning} ({symbol})",
                f"{value:.5g} ({low:.5g} to {high:.5g}){unit}",
                ANSWERS[statuses[-1]] + ("" if statuses[-1] == "good" else f": {why}"),
            ]
        )
    values = Table(
        columns=["Parameter", "value (95 % interval)", "trust it"],
        rows=rows,
        statuses=statuses,
        caption="MV: magnet valve; PV: protection valve. Intervals hold the sensors' noise, not what "
        "the model lacks.",
    )
    verdict = Verdict(status=worst(common), text=f"{text}.")
    return Section(title="Calibrated values", summary=True, verdicts=[verdict], blocks=[values])
