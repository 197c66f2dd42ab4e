"""What a calibration is about: recordings, their noise, and the parameters that may move."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from epv_env.plant.parameters import ParameterError, Parameters
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.drive import without_offsets
from identification.misfit import Misfit, noise_weights, report_weights
from identification.noise import noise_of
from identification.quality.assess import assess
from identification.recordings import UNITS, Campaign, CampaignError, Recording
from identification.vector import Vector


@dataclass(frozen=True, kw_only=True)
class Problem:
    """Recordings free of their sensors' offsets, and a vector of parameters to fit to them."""

    calibration: tuple[Recording, ...]
    validation: tuple[Recording, ...]
    noise: Mapping[str, float]
    """Standard deviation of each channel's noise [SI units]."""
    offsets: Mapping[str, float]
    """What was subtracted from each channel [SI units]; empty without a record at rest."""
    offset_errors: Mapping[str, float]
    """Their standard errors."""
    vector: Vector
    """Its reference is where the calibration starts."""

    def least_squares(self) -> Misfit:
        """The calibration recordings' misfit in units of their noise."""
        return Misfit(self.calibration, self.vector, noise_weights(self.calibration, self.noise))

    def total_error(self) -> Misfit:
        """The calibration recordings' misfit by the report's total error (eqs 19-21)."""
        return Misfit(self.calibration, self.vector, report_weights(self.calibration))


def calibration_problem(
    campaign: Campaign,
    *,
    start: Parameters | None = None,
    symbols: Sequence[str] = CALIBRATED_SYMBOLS,
) -> Problem:
    """The problem that a campaign poses, from `start` (None: Table 10) at the campaign's ambient.

    Raises CampaignError if there is no recording to fit to; ParameterError for symbols that cannot be
    fitted.
    """
    if not campaign.of("calibration"):
        raise CampaignError(
            f"campaign {campaign.name!r} has no recording with role 'calibration': give at least one"
        )
    start = (start or Parameters.initial_guess()).replace(
        T_env=campaign.temperature, p_env=campaign.pressure
    )
    zero = [symbol for symbol in symbols if start[symbol] == 0]
    if zero:
        raise ParameterError(
            f"{', '.join(zero)} start at 0, from which a relative change leads nowhere: start elsewhere"
        )
    offsets, errors = _offsets(campaign)
    return Problem(
        calibration=tuple(without_offsets(r, offsets) for r in campaign.of("calibration")),
        validation=tuple(without_offsets(r, offsets) for r in campaign.of("validation")),
        noise=noise_of(campaign),
        offsets=offsets,
        offset_errors=errors,
        vector=Vector(symbols=tuple(symbols), reference=start),
    )


def _offsets(campaign: Campaign) -> tuple[dict[str, float], dict[str, float]]:
    """The sensors' offsets at the start of the first quality recording at rest, and standard errors."""
    for recording in campaign.of("quality"):
        quality = assess(recording, campaign.pressure)
        if quality.at_rest:
            found = {name: (c.trend, c.rest, UNITS[name][1]) for name, c in quality.channels.items()}
            return (
                {name: (trend.offset - rest) * unit for name, (trend, rest, unit) in found.items()},
                {name: trend.offset_error * unit for name, (trend, _, unit) in found.items()},
            )
    return {}, {}
