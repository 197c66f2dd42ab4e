"""What the virtual bench does: the report's recordings, a wider suite, and programmes as a file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any

from epv_env.common.files import JSONFileError, decoded, write_json
from epv_env.common.units import BAR
from epv_env.plant.channels import SENSORS, Sensor
from epv_env.plant.plantfile import VOLTAGE
from identification.bench.settings import BENCH
from identification.recordings.recording import HOLD, ROLES
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


FORMAT = "epv-programme/1"
"""Version of the file, in its field `format`."""

MILLISECONDS = 1e3
"""In a second."""


class ProgrammeError(ValueError):
    """A programme file cannot be read or run: the message names file, programme, rule and remedy."""


def save_programmes(
    programmes: Sequence[Programme],
    path: str | PathLike[str],
    sensors: Mapping[str, Sensor] = SENSORS,
) -> None:
    """Write programmes that `load_programmes` takes, whole or not at all.

    Raises ProgrammeError, before anything is written, for what could not be read back.
    """
    content = {"format": FORMAT, "programmes": [_content(programme) for programme in programmes]}
    _decode(str(path), content, sensors)
    write_json(path, content)


def load_programmes(
    path: str | PathLike[str], sensors: Mapping[str, Sensor] = SENSORS
) -> tuple[Programme, ...]:
    """The programmes of a file (docs/reference/files.md), every rule checked.

    sensors: of the bench, by channel [bar absolute, A or V]. Raises ProgrammeError.
    """
    remedy = "give the path of a JSON file, or write it anew"
    try:
        content = decoded(path, remedy=remedy, what="programme file", allow_nan=True)
    except JSONFileError as error:
        raise ProgrammeError(str(error)) from None
    return _decode(str(path), content, sensors)


def _content(programme: Programme) -> dict[str, Any]:
    case = programme.case
    return {
        "name": programme.name,
        "role": programme.role,
        "supply_bar": round(programme.p1 / BAR, 9),
        "circuit_bar": round(programme.p2 / BAR, 9),
        "voltage_V": programme.U_on,
        "first_ms": round(MILLISECONDS * case.first, 6),
        "openings_ms": [round(MILLISECONDS * opening, 6) for opening in case.openings],
        "pause_ms": round(MILLISECONDS * case.pause, 6),
        "duration_ms": round(MILLISECONDS * case.duration, 6),
    }


def _decode(path: str, content: Any, sensors: Mapping[str, Sensor]) -> tuple[Programme, ...]:
    version = content.get("format") if isinstance(content, dict) else None
    if version != FORMAT:
        raise ProgrammeError(
            f"programme file {path} has format {version!r}, this version reads {FORMAT!r}: write it anew"
        )
    entries = content.get("programmes")
    if not isinstance(entries, list) or not entries:
        raise ProgrammeError(f"programme file {path}: programmes is not a list of at least one: add one")
    programmes = tuple(
        _programme(f"{path}, programme {number}", entry, sensors)
        for number, entry in enumerate(entries, start=1)
    )
    names = [programme.name for programme in programmes]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ProgrammeError(f"{path}: two programmes are named {twice!r}: rename one")
    return programmes


def _programme(place: str, entry: Any, sensors: Mapping[str, Sensor]) -> Programme:
    if not isinstance(entry, dict):
        raise ProgrammeError(f"{place} is not an object: give its fields as in docs/reference/files.md")
    role = _text(place, entry, "role")
    if role not in ROLES:
        raise ProgrammeError(f"{place}: unknown role {role!r}: choose one of {', '.join(ROLES)}")
    supply = _number(place, entry, "supply_bar", sensors["p1"].low, sensors["p1"].high)
    return Programme(
        name=_file_name(place, entry),
        role=role,
        case=_case(place, entry, switches=role != "quality"),
        p1=round(supply * BAR, 6),
        p2=round(_number(place, entry, "circuit_bar", sensors["p2"].low, supply) * BAR, 6),
        U_on=_number(place, entry, "voltage_V", 1.0 if role != "quality" else 0.0, sensors["U"].high),
    )


def _case(place: str, entry: dict[str, Any], *, switches: bool) -> Case:
    """When the coil is switched off; a recording that `switches` needs at least one opening."""
    longest = MILLISECONDS * BENCH.longest_recording
    shortest = MILLISECONDS * BENCH.shortest_opening
    openings = entry.get("openings_ms")
    if not isinstance(openings, list) or (switches and not openings):
        raise ProgrammeError(
            f"{place}: openings_ms is not a list of lengths: give at least one, or the role 'quality'"
        )
    lengths = [_checked(place, "openings_ms", value, shortest, longest) for value in openings]
    first = _number(place, entry, "first_ms", MILLISECONDS * HOLD, longest)
    pause = _number(place, entry, "pause_ms", shortest, longest)
    duration = _number(place, entry, "duration_ms", MILLISECONDS * HOLD, longest)
    end = first + sum(lengths) + pause * (len(lengths) - 1)
    if lengths and end > duration:
        raise ProgrammeError(
            f"{place}: the last opening ends at {end:g} ms, beyond duration_ms = {duration:g}: "
            "lengthen the recording or leave an opening out"
        )
    return Case(
        name=str(entry["name"]),
        openings=tuple(length / MILLISECONDS for length in lengths),
        duration=duration / MILLISECONDS,
        first=first / MILLISECONDS,
        pause=pause / MILLISECONDS,
    )


def _file_name(place: str, entry: dict[str, Any]) -> str:
    """The programme's name, which becomes that of its recording's file."""
    name = _text(place, entry, "name")
    if not name.replace("_", "").replace("-", "").isalnum():
        raise ProgrammeError(
            f"{place}: name {name!r} does not name a file: use letters, digits, - and _ only"
        )
    return name


def _text(place: str, entry: dict[str, Any], field: str) -> str:
    value = entry.get(field)
    if not isinstance(value, str):
        raise ProgrammeError(
            f"{place}: {field} is missing or not text: give it as in docs/reference/files.md"
        )
    return value


def _number(place: str, entry: dict[str, Any], field: str, low: float, high: float) -> float:
    return _checked(place, field, entry.get(field), low, high)


def _checked(place: str, field: str, value: Any, low: float, high: float) -> float:
    """A number of a field inside its range; false for NaN, too."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ProgrammeError(f"{place}: {field} is missing or not a number ({value!r}): give one")
    if not low <= value <= high:
        raise ProgrammeError(
            f"{place}: {field} = {value!r} is outside {low:g} to {high:g}: choose one inside"
        )
    return float(value)
