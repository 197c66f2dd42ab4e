"""What the virtual bench does: the report's recordings, and a wider suite for diagnosis."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from epv_env.common.units import BAR
from epv_env.plant.plantfile import VOLTAGE
from identification.report_2003.cases import (
    CALIBRATION_CASES,
    CIRCUIT_PRESSURE,
    ENERGISED_VOLTAGE,
    SUPPLY_PRESSURE,
    VALIDATION_CASE,
    Case,
)


@dataclass(frozen=True, kw_only=True)
class Programme:
    """One recording: the case, and the conditions under which the bench runs it."""

    name: str
    """Of the recording and of its file."""
    role: str
    """One of recording.ROLES."""
    case: Case
    p1: float = SUPPLY_PRESSURE
    """Supply pressure at the start [Pa absolute]."""
    p2: float = CIRCUIT_PRESSURE
    """Circuit pressure at the start [Pa absolute]."""
    U_on: float = ENERGISED_VOLTAGE
    """Voltage of the energised coil [V]."""


REST = Case(name="Rest", openings=(), duration=5.0)
"""Section 4: five seconds with the coil off and every chamber exhausted to ambient pressure."""

REPORT_SUITE = (
    *(Programme(name=case.name.lower(), role="calibration", case=case) for case in CALIBRATION_CASES),
    Programme(name="validation", role="validation", case=VALIDATION_CASE, p2=6.0 * BAR),
    Programme(name="rest", role="quality", case=REST, U_on=0.0),
)
"""Sections 4, 5.2.1 and 7. The validation's circuit pressure leaves room for three openings."""

DIAGNOSIS_SUITE = (
    *REPORT_SUITE,
    Programme(
        name="low_supply", role="calibration", p1=9.0 * BAR, p2=5.0 * BAR,
        case=Case(name="Low supply", openings=(0.12, 0.12), duration=0.8),
    ),
    Programme(
        name="long_open", role="calibration", p1=11.0 * BAR, p2=4.5 * BAR,
        case=Case(name="Long open", openings=(0.4,), duration=1.2),
    ),
    Programme(
        name="hold", role="calibration", p1=12.0 * BAR, p2=7.5 * BAR,
        case=Case(name="Hold", openings=(0.08,), duration=2.5),
    ),
    Programme(
        name="high_voltage", role="calibration", p1=12.0 * BAR, p2=6.5 * BAR, U_on=27.0,
        case=Case(name="High voltage", openings=(0.1, 0.1), duration=0.65),
    ),
    Programme(
        name="steps", role="validation", p1=10.5 * BAR, p2=5.5 * BAR, U_on=24.0,
        case=Case(name="Steps", openings=(0.06, 0.09, 0.12, 0.075), duration=1.6, pause=0.25),
    ),
)  # fmt: skip
"""The report's recordings, and others that tell more causes of a gap apart."""

SUITES = {"report": REPORT_SUITE, "diagnosis": DIAGNOSIS_SUITE}
"""Programmes by the name of their suite."""


def at_voltage(suite: Sequence[Programme], voltage: float) -> tuple[Programme, ...]:
    """A suite for a coil made for another voltage [V] than the report's: all in the same ratio."""
    factor = voltage / VOLTAGE
    return tuple(replace(programme, U_on=factor * programme.U_on) for programme in suite)
