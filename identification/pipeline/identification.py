"""One campaign, everything that the stages of its identification share, and what a reader asks first."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from epv_env.plant.parameters import Parameters, table
from epv_env.plant.plantfile import Plant, load_plant, plant_subject
from identification.calibration.calibrate import (
    EXPLAINED,
    STARTS,
    Calibration,
    calibrate,
    inseparable_symbols,
    symbols_on_bounds,
)
from identification.calibration.problem import CalibrationProblem, calibration_problem
from identification.confidence import PRECISE, Confidence, assess_confidence
from identification.recordings.recording import Campaign
from identification.report.page import ANSWERS, Section, Table, Verdict
from identification.report_2003 import ACCEPTED_ERROR
from identification.validation import Validation, validate

ESTIMATOR = "least squares"
"""The method whose estimate goes on: it weighs the outputs by their noise, so it scatters least."""


@dataclass(frozen=True)
class Identification:
    """A campaign, where finished searches are kept, and what follows from both, computed once."""

    campaign: Campaign
    journal: Path
    """File of the finished searches."""
    seed: int = 0
    """Of the starts."""
    plant: Plant | None = None
    """The valve as its data sheet describes it; None: the report's, from Table 10."""
    starts: int = STARTS
    """Searches of each calibration method."""

    @property
    def hashes(self) -> dict[str, str]:
        """SHA-256 of each recording's file by name."""
        return {recording.name: recording.sha256 for recording in self.campaign.recordings}

    @cached_property
    def problem(self) -> CalibrationProblem:
        """What is to be fitted to which recordings. Raises CampaignError."""
        if self.plant is None:
            return calibration_problem(self.campaign)
        return calibration_problem(self.campaign, start=self.plant.parameters, free=self.plant.free)

    @cached_property
    def calibration(self) -> Calibration:
        """Both methods from every start."""
        return calibrate(
            self.problem,
            journal=self.journal,
            subject={
                **plant_subject(load_plant(self.plant)),
                "recordings": {r.name: r.digest() for r in self.campaign.recordings},
            },
            starts=self.starts,
            seed=self.seed,
        )

    @cached_property
    def confidence(self) -> Confidence:
        """Intervals and joint region."""
        return assess_confidence(self.calibration)

    @cached_property
    def validation(self) -> Validation:
        """The calibrated model on the held-out recordings. Raises CampaignError if there is none."""
        return validate(self.problem, self.parameters)

    @property
    def parameters(self) -> Parameters:
        """The estimate that goes on [SI]."""
        return self.calibration.parameters(ESTIMATOR)


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
