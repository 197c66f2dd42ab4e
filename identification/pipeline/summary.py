"""The first screen of the report: the calibrated values, what they mean, whether to trust them."""

from collections.abc import Sequence

from epv_env.plant.parameters import table
from identification.pipeline.identification import Identification
from identification.pipeline.trust import Reason, Trust, common_reasons, judge_values, worst
from identification.report.page import ANSWERS, Section, Table, Verdict

ADVICE = {
    "good": "The model with these values holds on recordings that were not fitted to",
    "doubt": "Use these values with care",
    "bad": "Do not use these values",
}
"""What to do with the values, by the status of what concerns them all."""


def summary_section(identification: Identification) -> Section:
    """The calibrated values with their meaning, their 95 % intervals and whether to trust them."""
    common = common_reasons(identification)
    return Section(
        title="Calibrated values",
        summary=True,
        verdicts=[_verdict(common)],
        blocks=[_values(identification, common, judge_values(identification))],
    )


def _verdict(common: Sequence[Reason]) -> Verdict:
    status = worst(common)
    reasons = "; ".join(reason.text for reason in common)
    return Verdict(status=status, text=f"{ADVICE[status]}{': ' if reasons else ''}{reasons}.")


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
