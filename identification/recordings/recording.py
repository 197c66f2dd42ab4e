"""Recordings of a bench in SI units: what every stage of the identification works on."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import BAR
from epv_env.plant.channels import CHANNEL, MEASURED_CHANNELS
from identification.recordings.rules import RULES, RecordingRules

ROLES = ("calibration", "validation", "quality")
"""What a recording may be used for: fitting, testing only, statistics of the noise (section 4)."""

OUTPUTS = tuple(channel.name for channel in MEASURED_CHANNELS if channel.output)
"""Measured outputs y of the model (eq. 4)."""

CHANNELS = tuple(sorted(CHANNEL))
"""Names of the measured signals, in the order of the report's Table 1, which is the alphabet's."""

UNITS = {name: (CHANNEL[name].unit, CHANNEL[name].scale) for name in CHANNELS}
"""Unit in which people read each channel, and its size in SI units."""

PRESSURES = tuple(name for name in CHANNELS if UNITS[name][0] == "bar")
"""Channels that are pressures: vented, they read the ambient pressure; one device rounds them alike."""

HOLD = 0.04
"""Recordings start in steady state, energised, for at least this long [s]."""


class CampaignError(ValueError):
    """A campaign breaks a rule of docs/reference/files.md: what, where, the rule, the remedy."""


@dataclass(frozen=True, kw_only=True)
class Recording:
    """One recording of the bench; arrays have shape (samples,) and SI units."""

    name: str
    """The file's name without its suffix."""
    role: str
    """One of ROLES."""
    period: float
    """Time between samples [s]; the first sample is at time 0."""
    I: NDArray  # noqa: E741 - the report's symbol
    """Solenoid current [A]."""
    U: NDArray
    """Solenoid voltage, fed back [V]."""
    p1: NDArray
    """Input chamber pressure [Pa absolute]."""
    p2: NDArray
    """Output chamber (circuit) pressure [Pa absolute]."""
    p3: NDArray
    """Control chamber pressure [Pa absolute]."""
    sigma_S: NDArray
    """Air consumed from the circuit [kg/s]; zero where it was not measured."""
    sha256: str = ""
    """Of the file's bytes; empty for a recording that was not read from a file."""

    def __len__(self) -> int:
        return len(self.U)

    @property
    def time(self) -> NDArray:
        """Times of the samples, (samples,) [s]."""
        return np.arange(len(self)) * self.period

    @property
    def energised(self) -> NDArray:
        """Whether the coil is on: U above half its greatest value, boolean (samples,)."""
        return 0.5 * np.max(self.U) < self.U

    def digest(self) -> str:
        """SHA-256 of what was measured, the same whether it was read from a file or not."""
        digest = hashlib.sha256(repr((self.role, self.period)).encode())
        for name in (*CHANNELS, "sigma_S"):
            digest.update(np.ascontiguousarray(getattr(self, name), dtype=float).tobytes())
        return digest.hexdigest()

    def channel(self, name: str) -> NDArray:
        """The signal of one of CHANNELS, (samples,) [SI]. Raises CampaignError for another name."""
        if name not in CHANNELS:
            raise CampaignError(f"no channel is named {name!r}: choose one of {', '.join(CHANNELS)}")
        return getattr(self, name)


@dataclass(frozen=True, kw_only=True)
class Campaign:
    """The recordings of one bench, and the ambient conditions they share."""

    name: str
    """Of the bench or the session."""
    temperature: float
    """T_env [K]."""
    pressure: float
    """p_env [Pa absolute]."""
    recordings: tuple[Recording, ...]
    folder: Path | None = None
    rules: RecordingRules = RULES
    """Limits and sensors of the bench and its valve, by which the recordings are read."""

    def with_role(self, role: str) -> tuple[Recording, ...]:
        """The recordings with one of ROLES."""
        return tuple(recording for recording in self.recordings if recording.role == role)


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
