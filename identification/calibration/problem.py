"""What a calibration is about: recordings, their noise, and the parameters that may move."""

from collections.abc import Mapping
from dataclasses import dataclass

from epv_env.plant.free_parameters import FREE_PARAMETERS, Freedom, check_free
from epv_env.plant.parameters import Parameters
from identification.quality.assessment import SensorOffset, assess_recording, sensor_offsets
from identification.recordings.noise import campaign_steps, pooled_noise
from identification.recordings.recording import Campaign, CampaignError, Recording
from identification.replay.model_inputs import without_offsets
from identification.replay.parameter_vector import ParameterVector
from identification.replay.weighted_residuals import WeightedResiduals, noise_weights, report_weights


@dataclass(frozen=True, kw_only=True)
class CalibrationProblem:
    """Recordings free of their sensors' offsets, and a vector of parameters to fit to them."""

    calibration: tuple[Recording, ...]
    validation: tuple[Recording, ...]
    noise: Mapping[str, float]
    """Standard deviation of each channel's noise [SI units]."""
    offsets: Mapping[str, SensorOffset]
    """What was subtracted from each channel; empty without a record at rest."""
    steps: Mapping[str, float]
    """Coarse steps of the readings by channel [SI]; empty on a bench whose noise moves every reading."""
    vector: ParameterVector
    """Its reference is where the calibration starts."""

    def least_squares(self) -> WeightedResiduals:
        """The calibration recordings' misfit in units of their noise."""
        return WeightedResiduals(
            self.calibration, self.vector, noise_weights(self.calibration, self.noise)
        )

    def total_error(self) -> WeightedResiduals:
        """The calibration recordings' misfit by the report's total error (eqs 19-21)."""
        return WeightedResiduals(self.calibration, self.vector, report_weights(self.calibration))


def calibration_problem(
    campaign: Campaign,
    *,
    start: Parameters | None = None,
    free: Mapping[str, Freedom] = FREE_PARAMETERS,
) -> CalibrationProblem:
    """The problem that a campaign poses, from `start` (None: Table 10) at the campaign's ambient.

    free: which parameters may move, and how far.

    Raises CampaignError if there is no recording to fit to; ParameterError for parameters that
    cannot be fitted, or ambient conditions outside the plant's domain.
    """
    if not campaign.with_role("calibration"):
        raise CampaignError(
            f"campaign {campaign.name!r} has no recording with role 'calibration': give at least one"
        )
    start = (start or Parameters.initial_guess()).replace(
        T_env=campaign.temperature, p_env=campaign.pressure
    )
    check_free(free, start)
    steps = campaign_steps(campaign.recordings, campaign.rules)
    offsets = _offsets(campaign, steps)
    values = {name: offset.value for name, offset in offsets.items()}
    return CalibrationProblem(
        calibration=tuple(without_offsets(r, values) for r in campaign.with_role("calibration")),
        validation=tuple(without_offsets(r, values) for r in campaign.with_role("validation")),
        noise=pooled_noise(campaign),
        offsets=offsets,
        steps=steps,
        vector=ParameterVector(symbols=tuple(free), reference=start, freedoms=free),
    )


def _offsets(campaign: Campaign, steps: Mapping[str, float]) -> dict[str, SensorOffset]:
    """The sensors' offsets from the first quality recording that shows them."""
    for recording in campaign.with_role("quality"):
        sensors = campaign.rules.sensors
        assessed = assess_recording(recording, campaign.pressure, steps, sensors)
        offsets = sensor_offsets(assessed)
        if offsets:
            return offsets
    return {}
