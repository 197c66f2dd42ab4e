"""What a page says first about a campaign: its name, its recordings, its environment."""

from epv_env.common.units import BAR
from identification.recordings.recording import ROLES, Campaign


def campaign_facts(campaign: Campaign) -> dict[str, str]:
    """Facts by name, ready to read."""
    listed = "; ".join(
        f"{', '.join(recording.name for recording in recordings)} ({role})"
        for role in ROLES
        if (recordings := campaign.with_role(role))
    )
    samples = sum(len(recording) for recording in campaign.recordings)
    return {
        "Campaign": campaign.name,
        "Recordings": f"{listed}; {samples:,} samples",
        "Environment": f"{campaign.temperature:.1f} K, {campaign.pressure / BAR:.3f} bar",
    }
