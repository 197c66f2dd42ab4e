"""Recordings of a bench in SI units: what every stage of the identification works on."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import BAR
from epv_env.plant.channels import CHANNEL, MEASURED_CHANNELS, SENSORS, Sensor
from epv_env.plant.force_balance import venting_rate
from epv_env.plant.plantfile import VOLTAGE, Plant

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


VENTING_SYMBOLS = ("alphaMV", "dMVexh", "V3")
"""Parameters that decide how fast the control chamber vents."""


USUAL_VENTING = 7.7
"""Rate of a choked discharge of the report's valve [1/s]."""


@dataclass(frozen=True, kw_only=True)
class RecordingRules:
    """What a bench and its valve allow; the defaults are those of the report's."""

    sensors: Mapping[str, Sensor] = field(default_factory=lambda: SENSORS)
    """Sensor of each channel [bar absolute, A or V]; Tables 1 to 3."""
    operating_voltages: tuple[float, float] = (6.0, 32.32)
    """Voltages of an energised coil [V]: from half of 12 V to the sensor's end with its accuracy."""
    coil_resistances: tuple[float, float] = (8.0, 220.0)
    """Holding voltage over holding current [Ohm] of a coil of this kind; the report's has 42. Five times
    to either side leaves room for other coils, and none for a wrong unit, which is 1000 times off."""
    venting_rates: tuple[float, float] = (4.5, 14.0)
    """Rates of a choked discharge of p3 [1/s]. The report's valve has 7.7, and 2300 recordings of
    benches with every effect lie between 5.6 and 9.8. Outside, the times are wrong."""

    @property
    def pressure_margin(self) -> float:
        """Accuracy of the pressure sensors, of the worst of them [bar]."""
        return max(self.sensors[name].margin for name in ("p1", "p2", "p3"))


RULES = RecordingRules()
"""Those of the report's bench (docs/reference/files.md)."""


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


def rules_of(plant: Plant) -> RecordingRules:
    """The rules for recordings of another plant.

    The report's limits stand in the same ratios to its own coil, voltage and venting rate as they do
    here. Where the plant has own domains of what sets its venting rate, they widen the rates.
    """
    p = plant.parameters
    ends = [(p[s], *p.own_domains.get(s, ())) for s in VENTING_SYMBOLS]
    rates = [
        venting_rate(p.replace(**dict(zip(VENTING_SYMBOLS, values, strict=True))))
        for values in product(*ends)
    ]
    slowest, fastest = (rate / USUAL_VENTING for rate in RULES.venting_rates)
    R, voltage = p["R"], plant.sensors["U"]
    least, greatest = RULES.coil_resistances
    middle = (least * greatest) ** 0.5
    return RecordingRules(
        sensors=plant.sensors,
        operating_voltages=(
            RULES.operating_voltages[0] * plant.voltage / VOLTAGE,
            voltage.high * (1 + voltage.accuracy),
        ),
        coil_resistances=(least * R / middle, greatest * R / middle),
        venting_rates=(slowest * min(rates), fastest * max(rates)),
    )
