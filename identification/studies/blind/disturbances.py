"""Disturbances under which the trials of a blind check are diagnosed again."""

from epv_env.plant.channels import SENSORS
from identification.bench.session import add_ripple, round_pressures
from identification.recordings.recording import OUTPUTS, Campaign
from identification.studies.blind.noise_free_gap import noise_deviation
from identification.studies.blind.settings import DEFAULTS, BlindSettings

SIGMA_LOW, SIGMA_HIGH, RIPPLE, STEPS = "sigma=0.3", "sigma=3", "ripple", "steps"

NOISE_FACTORS = {SIGMA_LOW: 0.3, SIGMA_HIGH: 3.0}
"""By which the noise that the diagnosis is told is too small or too large [-]."""

DISTURBANCES = {
    SIGMA_LOW: "the diagnosis is told 0.3 times the sensors' noise",
    SIGMA_HIGH: "the diagnosis is told three times the sensors' noise",
    RIPPLE: "p2 and p3 carry a slow ripple of twice their noise",
    STEPS: "pressures in steps of 50 mbar",
}
"""Every disturbance with what it does."""


def told_noise(disturbance: str) -> dict[str, float] | None:
    """Noise by channel [SI] that the diagnosis is told; None: it estimates the noise itself."""
    factor = NOISE_FACTORS.get(disturbance)
    return None if factor is None else {name: factor * noise_deviation(name) for name in OUTPUTS}


def disturbs_recordings(disturbance: str) -> bool:
    """Whether the disturbance changes the recordings."""
    return disturbance in (RIPPLE, STEPS)


def disturbed(
    campaign: Campaign, disturbance: str, *, seed: int, settings: BlindSettings = DEFAULTS
) -> Campaign:
    """The campaign with a disturbance of its recordings; seed: of the ripple."""
    if disturbance == STEPS:
        return round_pressures(campaign, settings.pressure_step)
    if disturbance == RIPPLE:
        sd = {name: settings.ripple_size * SENSORS[name].noise for name in settings.ripple_channels}
        return add_ripple(campaign, sd=sd, correlation_time=settings.ripple_time, seed=seed)
    return campaign
