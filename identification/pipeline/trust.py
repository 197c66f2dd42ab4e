"""Whether to trust each calibrated value: a status and its reasons, in a line."""

from collections.abc import Sequence
from dataclasses import dataclass

from identification.calibration.calibration_warnings import inseparable_symbols, symbols_on_bounds
from identification.pipeline.identification import ESTIMATOR, Identification


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
    best, settings = calibration.best(ESTIMATOR), calibration.settings
    at_ends = symbols_on_bounds(calibration.problem, best, settings.near_bound)
    inseparable, _ = inseparable_symbols(calibration.problem, best, settings)
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
        if width >= confidence.settings.precise:
            reasons.append(Reason(status="doubt", text=f"its interval is wide, ±{100 * width:.2g} %"))
        found.append(Trust(symbol=symbol, reasons=reasons))
    return found


def _held_out(identification: Identification) -> list[Reason]:
    if not identification.campaign.with_role("validation"):
        return [Reason(status="doubt", text="no recording was held out to check the model on")]
    validation = identification.validation
    settings = validation.settings
    if validation.worst >= settings.accepted_error:
        text = (
            f"the model misses held-out recordings by {100 * validation.worst:.3g} %, where "
            f"{100 * settings.accepted_error:.0f} % is the limit"
        )
        return [Reason(status="bad", text=text)]
    most = max(validation.residuals, key=lambda residual: residual.rms)
    if most.rms <= settings.explained:
        return []
    text = (
        f"the model lacks something that the values absorb: held-out {most.output} is missed by "
        f"{most.rms:.3g} times the noise"
    )
    return [Reason(status="doubt", text=text)]
