"""Operation logs of a control unit: log.json and one CSV per drive (docs/reference/files.md)."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import BAR
from epv_env.operation_log import DECIMALS, FILE_NAME, FORMAT
from identification.recordings.campaign_files import (
    Environment,
    checked_ambient,
    content_of,
    named_files,
    read_manifest,
)
from identification.recordings.columns import Place, read_columns, sampling_period
from identification.recordings.plausibility import check_units, gauge_contradiction
from identification.recordings.recording import HOLD, RULES, CampaignError, RecordingRules
from identification.recordings.recording_checks import check_range

PERIOD_TOLERANCE = 1e-3
"""Relative difference between the stated control period and that of the times [-]."""
REST = 0.05
"""Relative range of p3 within HOLD up to which the control chamber is at rest [-]."""
LONGEST = 0.6
"""Longest opening [s]: a longer one tells less and takes longer to simulate."""
MOST_CHECKED = 20
"""Openings of a drive that are checked, evenly over the drive."""
LEAST_FALLING = 8
"""Rows of a discharge that tells, together with others, where p3 vents to."""
CONTRADICTED = 0.25
"""Share of these that contradict physics beyond which a drive is refused."""


@dataclass(frozen=True, kw_only=True)
class Drive:
    """One drive; arrays have shape (samples,), a row per control period."""

    file: str
    """Its file's name."""
    coil: NDArray
    """Command from the row's time on: 0 off, 1 on."""
    U: NDArray
    """Coil voltage: that of the supply while the coil is on [V]."""
    p1: NDArray
    """Input chamber pressure [Pa absolute]."""
    p2: NDArray
    """Circuit pressure [Pa absolute]."""
    p3: NDArray
    """Control chamber pressure [Pa absolute]."""
    I: NDArray  # noqa: E741 - the report's symbol
    """Coil current [A]."""
    target: NDArray
    """What the controller holds the circuit pressure at [Pa absolute]."""


@dataclass(frozen=True, kw_only=True)
class Log:
    """The drives of one valve, in order of time."""

    name: str
    temperature: float
    """T_env [K]."""
    pressure: float
    """p_env [Pa absolute]."""
    period: float
    """Control period [s]."""
    drives: tuple[Drive, ...]

    def check_period(self, period: float, needs: str) -> None:
        """Raises CampaignError for another control period [s]. needs: words before it in the error."""
        if abs(self.period / period - 1.0) > PERIOD_TOLERANCE:
            raise CampaignError(
                f"{self.name} has a row each {1e3 * self.period:g} ms, but {needs} {1e3 * period:g} ms: "
                "give a log of that control period"
            )


class _Entry(msgspec.Struct):
    file: str


class _Manifest(msgspec.Struct):
    format: str
    name: str
    control_period_s: float
    environment: Environment
    drives: list[_Entry]


def read_log(folder: str | PathLike[str], rules: RecordingRules = RULES) -> Log:
    """The operation log in a folder. Raises CampaignError: what, where, the rule and the remedy.

    rules: what readings of its valve can be.
    """
    file = Path(folder) / FILE_NAME
    remedy = "give the folder of an operation log (docs/reference/files.md)"
    manifest = read_manifest(file, _Manifest, FORMAT, remedy)
    temperature, pressure = checked_ambient(file, manifest.environment)
    period = manifest.control_period_s
    columns = {
        path: _columns(path, period)
        for path in named_files(file, "drives", [entry.file for entry in manifest.drives])
    }
    every = [_fault(str(path), own, period, pressure / BAR, rules) for path, own in columns.items()]
    faults = [fault for fault in every if fault]
    if len(faults) == len(every):
        raise faults[0]
    for path, own in columns.items():
        for name in ("U_supply_V", "p1_bar", "p2_bar", "p3_bar", "I_A"):
            check_range(Place(file=str(path)), name, own[name], rules.sensors[name.split("_")[0]])
        check_range(Place(file=str(path)), "target_bar", own["target_bar"], rules.sensors["p2"])
    _check_reference(Path(folder), list(columns.values()), period, pressure / BAR)
    return Log(
        name=manifest.name,
        temperature=temperature,
        pressure=pressure,
        period=period,
        drives=tuple(
            Drive(
                file=path.name,
                coil=drive["coil"],
                U=drive["U_V"],
                I=drive["I_A"],
                **{name: drive[f"{name}_bar"] * BAR for name in ("p1", "p2", "p3", "target")},
            )
            for path, drive in columns.items()
        ),
    )


def _columns(path: Path, period: float) -> dict[str, NDArray]:
    """A drive's columns by name, each (samples,), in the unit of the name; U_V is the coil's voltage."""
    columns = read_columns(str(path), content_of(path), tuple(DECIMALS))
    printed = sampling_period(str(path), columns["time_s"])
    if abs(printed - period) > PERIOD_TOLERANCE * printed:
        raise CampaignError(
            f"{path}: rows follow each other in {printed:g} s, but {FILE_NAME} states a control period "
            f"of {period:g} s: correct control_period_s"
        )
    coil = columns["coil"]
    if not np.all(np.isin(coil, (0.0, 1.0))):
        raise CampaignError(f"{path}: coil is {coil[~np.isin(coil, (0, 1))][0]:g}: give 0 or 1")
    return columns | {"U_V": coil * columns["U_supply_V"]}


def _fault(
    path: str, columns: Mapping[str, NDArray], period: float, ambient: float, rules: RecordingRules
) -> CampaignError | None:
    """What many openings of a drive contradict; the diagnosis is to find it, unless all drives do.

    A wrong unit or reference contradicts physics in opening after opening, a fault of the valve in few.
    ambient: p_env [bar absolute].
    """
    found = list(_openings(columns["coil"], columns["p3_bar"], period))
    checked, told = found[:: len(found) // MOST_CHECKED + 1], list[CampaignError]()
    for part in checked:
        try:
            place = Place(file=Place(file=path).samples(part.start))
            check_units(place, {name: c[part] for name, c in columns.items()}, period, ambient, rules)
        except CampaignError as error:
            told.append(CampaignError(str(error).replace("U_V", "U_supply_V")))
    return told[0] if len(told) > CONTRADICTED * len(checked) else None


def _check_reference(
    folder: Path, drives: Sequence[Mapping[str, NDArray]], period: float, ambient: float
) -> None:
    """Raise CampaignError if the openings of all drives show gauge pressure; one is too short for that.

    ambient: p_env [bar absolute].
    """
    parts = [(own, part) for own in drives for part in _openings(own["coil"], own["p3_bar"], period)]
    if not parts:
        return
    p3 = np.concatenate([own["p3_bar"][part] for own, part in parts])
    on = np.concatenate([own["coil"][part] for own, part in parts]) > 0.0
    for found in gauge_contradiction(p3, on, ambient, LEAST_FALLING):
        raise CampaignError(f"{folder}: {found}: give p1_bar, p2_bar and p3_bar in bar absolute")


def _openings(coil: NDArray, p3: NDArray, period: float) -> Iterator[slice]:
    """Rows from HOLD before to after each switching-off of coil (samples,) before which p3 rests."""
    hold, changes = max(1, round(HOLD / period)), np.flatnonzero(np.diff(coil)) + 1
    for number, i in enumerate(changes):
        before = slice(max(i - hold, 0), i)
        if (
            coil[i] == 0.0
            and i >= hold
            and np.all(coil[before])
            and np.ptp(p3[before]) <= REST * np.max(np.abs(p3[before]))
        ):
            end = changes[number + 1] if number + 1 < len(changes) else len(coil)
            yield slice(int(before.start), int(min(end, i + LONGEST / period)))
