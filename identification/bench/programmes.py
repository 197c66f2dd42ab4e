"""What the virtual bench does: the report's recordings, a wider suite, and programmes as a file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike

import msgspec

from epv_env.common.files import JSONFileError, read_json, write_json
from epv_env.common.units import BAR
from epv_env.plant.channels import SENSORS, Sensor
from epv_env.plant.plantfile import VOLTAGE
from identification.recordings.recording import HOLD, ROLES
from identification.report_2003 import (
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


FORMAT = "epv-programme/1"
"""Version of a programme file, in its field `format`."""

LONGEST_MS, SHORTEST_MS = 60e3, 1.0
"""Longest recording; shortest time for which the coil is off, or on between two openings [ms]."""


class ProgrammeError(ValueError):
    """A programme file cannot be read or run: the message names file, programme, rule and remedy."""


class _Entry(msgspec.Struct):
    """A programme as its file has it; the first opening starts at `first_ms`."""

    name: str
    role: str
    supply_bar: float
    circuit_bar: float
    voltage_V: float
    first_ms: float
    openings_ms: list[float]
    pause_ms: float
    duration_ms: float


class _File(msgspec.Struct):
    format: str
    programmes: list[_Entry]


def save_programmes(
    programmes: Sequence[Programme],
    path: str | PathLike[str],
    sensors: Mapping[str, Sensor] = SENSORS,
) -> None:
    """Write programmes that `load_programmes` takes, whole or not at all.

    Raises ProgrammeError, before anything is written, for what could not be read back.
    """
    content = _File(FORMAT, [_entry(programme) for programme in programmes])
    _programmes(path, content, sensors)
    write_json(path, msgspec.to_builtins(content))


def load_programmes(
    path: str | PathLike[str], sensors: Mapping[str, Sensor] = SENSORS
) -> tuple[Programme, ...]:
    """The programmes of a file (docs/reference/files.md), every rule checked.

    sensors: of the bench, by channel [bar absolute, A or V]. Raises ProgrammeError.
    """
    remedy = "write it as docs/reference/files.md shows"
    try:
        content = read_json(path, _File, version=FORMAT, remedy=remedy)
    except JSONFileError as error:
        raise ProgrammeError(f"programme file: {error}") from None
    return _programmes(path, content, sensors)


def _entry(programme: Programme) -> _Entry:
    case = programme.case
    return _Entry(
        name=programme.name,
        role=programme.role,
        supply_bar=round(programme.p1 / BAR, 9),
        circuit_bar=round(programme.p2 / BAR, 9),
        voltage_V=programme.U_on,
        first_ms=round(1e3 * case.first, 6),
        openings_ms=[round(1e3 * opening, 6) for opening in case.openings],
        pause_ms=round(1e3 * case.pause, 6),
        duration_ms=round(1e3 * case.duration, 6),
    )


def _programmes(
    path: str | PathLike[str], content: _File, sensors: Mapping[str, Sensor]
) -> tuple[Programme, ...]:
    if not content.programmes:
        raise ProgrammeError(f"{path}: programmes is empty: add one")
    programmes = tuple(
        _programme(f"{path}, programme {number}", entry, sensors)
        for number, entry in enumerate(content.programmes, start=1)
    )
    names = [programme.name for programme in programmes]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ProgrammeError(f"{path}: two programmes are named {twice!r}: rename one")
    return programmes


def _programme(place: str, entry: _Entry, sensors: Mapping[str, Sensor]) -> Programme:
    if not entry.name.replace("_", "").replace("-", "").isalnum():  # it becomes that of a file
        raise ProgrammeError(
            f"{place}: name {entry.name!r} does not name a file: use letters, digits, - and _ only"
        )
    if entry.role not in ROLES:
        raise ProgrammeError(f"{place}: unknown role {entry.role!r}: choose one of {', '.join(ROLES)}")
    switching = entry.role != "quality"
    if switching and not entry.openings_ms:
        raise ProgrammeError(f"{place}: openings_ms is empty: give at least one, or the role 'quality'")
    ranges = {
        "supply_bar": (entry.supply_bar, sensors["p1"].low, sensors["p1"].high),
        "circuit_bar": (entry.circuit_bar, sensors["p2"].low, entry.supply_bar),
        "voltage_V": (entry.voltage_V, 1.0 if switching else 0.0, sensors["U"].high),
        "first_ms": (entry.first_ms, 1e3 * HOLD, LONGEST_MS),
        "pause_ms": (entry.pause_ms, SHORTEST_MS, LONGEST_MS),
        "duration_ms": (entry.duration_ms, 1e3 * HOLD, LONGEST_MS),
        **{f"openings_ms[{i}]": (x, SHORTEST_MS, LONGEST_MS) for i, x in enumerate(entry.openings_ms)},
    }
    for name, (value, low, high) in ranges.items():
        if not low <= value <= high:
            raise ProgrammeError(
                f"{place}: {name} = {value!r} is outside {low:g} to {high:g}: choose one inside"
            )
    end = entry.first_ms + sum(entry.openings_ms) + entry.pause_ms * (len(entry.openings_ms) - 1)
    if entry.openings_ms and end > entry.duration_ms:
        raise ProgrammeError(
            f"{place}: the last opening ends at {end:g} ms, beyond duration_ms = "
            f"{entry.duration_ms:g}: lengthen the recording or leave an opening out"
        )
    return Programme(
        name=entry.name,
        role=entry.role,
        case=Case(
            name=entry.name,
            openings=tuple(length / 1e3 for length in entry.openings_ms),
            duration=entry.duration_ms / 1e3,
            first=entry.first_ms / 1e3,
            pause=entry.pause_ms / 1e3,
        ),
        p1=round(entry.supply_bar * BAR, 6),
        p2=round(entry.circuit_bar * BAR, 6),
        U_on=float(entry.voltage_V),
    )
