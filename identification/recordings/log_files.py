"""Operation logs of a control unit: log.json and one CSV per drive (docs/reference/files.md)."""

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from numpy.typing import NDArray

from epv_env.common.files import JSONFileError, read_bytes, read_json
from epv_env.common.units import BAR
from epv_env.operation_log import DECIMALS, FILE_NAME, FORMAT
from identification.recordings.campaign_files import Environment, ambient
from identification.recordings.columns import read_named_columns, sampling_period
from identification.recordings.recording import CampaignError

PERIOD_TOLERANCE = 1e-3
"""Relative difference between the stated control period and that of the times [-]."""


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
    control_period_s: Annotated[float, msgspec.Meta(gt=0)]
    environment: Environment
    drives: list[_Entry]


def read_log(folder: str | PathLike[str]) -> Log:
    """The operation log in a folder. Raises CampaignError: what, where, the rule and the remedy."""
    folder = Path(folder)
    remedy = "give the folder of an operation log (docs/reference/files.md)"
    try:
        manifest = read_json(folder / FILE_NAME, _Manifest, version=FORMAT, remedy=remedy)
    except JSONFileError as error:
        raise CampaignError(str(error)) from None
    if not manifest.drives:
        raise CampaignError(f"{folder / FILE_NAME}: drives is empty: name at least one file")
    temperature, pressure = ambient(folder / FILE_NAME, manifest.environment)
    return Log(
        name=manifest.name,
        temperature=temperature,
        pressure=pressure,
        period=manifest.control_period_s,
        drives=tuple(_drive(folder, entry.file, manifest.control_period_s) for entry in manifest.drives),
    )


def _drive(folder: Path, file: str, period: float) -> Drive:
    path = folder / file
    if Path(file).name != file:
        raise CampaignError(f"{folder / FILE_NAME}: file {file!r} leaves the folder: copy it there")
    try:
        columns = read_named_columns(str(path), read_bytes(path), tuple(DECIMALS))
    except OSError as error:
        raise CampaignError(f"{path} cannot be read ({error.strerror}): add the file") from None
    found = sampling_period(str(path), columns["time_s"])
    if abs(found / period - 1.0) > PERIOD_TOLERANCE:
        raise CampaignError(
            f"{path}: rows follow each other in {found:g} s, but {FILE_NAME} states a control period of "
            f"{period:g} s: correct control_period_s"
        )
    coil = columns["coil"]
    if not np.all(np.isin(coil, (0.0, 1.0))):
        raise CampaignError(f"{path}: coil is {coil[~np.isin(coil, (0, 1))][0]:g}: give 0 or 1")
    return Drive(
        file=file,
        coil=coil,
        U=coil * columns["U_supply_V"],
        I=columns["I_A"],
        **{name: columns[f"{name}_bar"] * BAR for name in ("p1", "p2", "p3", "target")},
    )
