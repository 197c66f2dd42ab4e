"""The plant file: parameters, effects and region as versioned JSON (docs/reference/files.md)."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from epv_env.common.files import JSONFileError, checked, decoded, write_json
from epv_env.plant.channels import SENSORS, Sensor, changed_fields, own_sensors
from epv_env.plant.effects.registry import CATALOGUE
from epv_env.plant.force_balance import check_valve
from epv_env.plant.free_parameters import FREE_PARAMETERS, Freedom, check_free
from epv_env.plant.parameters import ParameterError, Parameters
from epv_env.plant.region import Region

FORMAT = "epv-plant/1"
"""Version of the file, in its field `format`."""

REMEDY = "the file is not of the form that docs/reference/files.md describes; write it anew"
"""What to do about a file with a wrong field; ends a message."""


VOLTAGE = 24.0
"""Voltage of the report's energised coil [V]."""


class PlantFileError(ValueError):
    """A plant file cannot be read: the message names file, fault and remedy."""


@dataclass(frozen=True, kw_only=True)
class Plant:
    """A calibrated plant: its best parameters and, if identification found it, its joint region."""

    parameters: Parameters
    """Best parameters [SI]."""
    region: Region
    """What the calibration leaves uncertain; Table 14's intervals where nothing better is known."""
    name: str = "calibrated"
    """Name in reports and plots."""
    provenance: dict[str, Any] = field(default_factory=dict)
    """Where the values come from (recordings, hashes, versions); free-form."""
    voltage: float = VOLTAGE
    """Of the energised coil [V]."""
    sensors: Mapping[str, Sensor] = field(default_factory=lambda: SENSORS)
    """The bench's sensor of each channel [bar absolute, A or V]."""
    free: Mapping[str, Freedom] = field(default_factory=lambda: FREE_PARAMETERS)
    """What a calibration may move, by symbol."""

    @classmethod
    def calibrated(cls) -> "Plant":
        """The report's own calibration: Table 12, with Table 14 as its region."""
        parameters = Parameters.calibrated()
        return cls(
            parameters=parameters,
            region=Region.named("confidence", parameters),
            provenance={"source": "SCL-001/2003, Tables 5-7, 12 and 14"},
        )


class _JointFields(msgspec.Struct):
    """Field `region.joint`: parameters that are uncertain together."""

    symbols: tuple[str, ...]
    covariance: list[list[float]]
    chi_square: float


class _FreeFields(msgspec.Struct, forbid_unknown_fields=True):
    """A parameter of field `free`."""

    bounds: tuple[float, float] | None = None
    mean: float | None = None
    sd: float | None = None


class _RegionFields(msgspec.Struct):
    """Field `region`."""

    boxes: dict[str, tuple[float, float]] = {}
    joint: _JointFields | None = None


class _PlantFile(msgspec.Struct):
    """A plant file; values of parameters are checked by `Parameters`, which names their domains."""

    parameters: Any
    domains: dict[str, tuple[float, float]] = {}
    voltage_V: float = VOLTAGE
    sensors: dict[str, dict[str, float]] = {}
    free: dict[str, _FreeFields] | None = None
    effects: dict[str, dict[str, Any]] = {}
    region: _RegionFields = msgspec.field(default_factory=_RegionFields)
    name: str = "unnamed"
    provenance: dict[str, Any] = {}


def load_plant(source: "Plant | str | PathLike[str] | None") -> Plant:
    """A Plant from itself, a plant file, or (None) the report's calibration.

    Raises PlantFileError for a file that is missing, not JSON, of another version or malformed. A
    parameter that the file does not name has the report's calibrated value.
    """
    if isinstance(source, Plant):
        return source
    if source is None:
        return Plant.calibrated()
    path = Path(source)
    return _plant(_content(path), f"plant file {path}")


def _content(path: Path) -> _PlantFile:
    """The file's content, its fields and their types checked. Raises PlantFileError."""
    remedy = "give the path of a plant.json, or write it anew"
    try:
        # `Parameters` refuses a NaN with the parameter's name.
        content = decoded(path, remedy=remedy, what="plant file", allow_nan=True)
    except JSONFileError as error:
        raise PlantFileError(str(error)) from None
    version = content.get("format") if isinstance(content, dict) else None
    if version != FORMAT:
        raise PlantFileError(
            f"plant file {path} has format {version!r}, this version reads {FORMAT!r}: write it anew "
            "with this version's identification"
        )
    try:
        return checked(content, _PlantFile, where=f"plant file {path}: content", remedy=REMEDY)
    except JSONFileError as error:
        raise PlantFileError(str(error)) from None


def save_plant(plant: Plant, path: str | PathLike[str]) -> None:
    """Write a plant file, whole or not at all."""
    effects = {
        name: {symbol: plant.parameters[symbol] for symbol in symbols}
        for name, symbols in CATALOGUE.items()
    }
    sizing = {symbol for symbols in CATALOGUE.values() for symbol in symbols}
    content: dict[str, Any] = {
        "format": FORMAT,
        "name": plant.name,
        "parameters": {s: value for s, value in plant.parameters.items() if s not in sizing},
        "domains": {symbol: list(ends) for symbol, ends in plant.parameters.own_domains.items()},
        "voltage_V": plant.voltage,
        "sensors": changed_fields(plant.sensors),
        "free": {symbol: _given(freedom) for symbol, freedom in plant.free.items()},
        "effects": {name: sizes for name, sizes in effects.items() if any(sizes.values())},
        "region": {"boxes": {symbol: list(ends) for symbol, ends in plant.region.boxes.items()}},
        "provenance": plant.provenance,
    }
    if plant.region.covariance is not None:
        content["region"]["joint"] = {
            "symbols": list(plant.region.symbols),
            "covariance": plant.region.covariance.tolist(),
            "chi_square": plant.region.chi_square,
        }
    write_json(path, content)


def _plant(content: _PlantFile, place: str) -> Plant:
    """The plant that a file describes; place: how messages begin. Raises PlantFileError."""
    try:
        values = {**Parameters.calibrated(), **_values(content)}
        parameters = Parameters(values, content.domains)
        sensors = own_sensors(content.sensors)
        if content.domains or content.sensors or content.voltage_V != VOLTAGE:
            check_valve(parameters, content.voltage_V, sensors)
        return Plant(
            parameters=parameters,
            region=_region(content.region, parameters),
            name=content.name,
            provenance=content.provenance,
            voltage=content.voltage_V,
            sensors=sensors,
            free=_free(content, parameters),
        )
    except ParameterError as error:
        raise PlantFileError(f"{place}: {error}") from None
    except ValueError as error:
        raise PlantFileError(f"{place}: {error}: {REMEDY}") from None


def _free(content: _PlantFile, parameters: Parameters) -> Mapping[str, Freedom]:
    """What a calibration may move. Raises ParameterError."""
    if content.free is None:
        return FREE_PARAMETERS
    free = {symbol: Freedom(**msgspec.structs.asdict(given)) for symbol, given in content.free.items()}
    check_free(free, parameters)
    return free


def _given(freedom: Freedom) -> dict[str, Any]:
    """The fields of a Freedom that say anything, for JSON."""
    return {name: value for name, value in asdict(freedom).items() if value is not None}


def _values(content: _PlantFile) -> dict[str, Any]:
    """Values by symbol, those of effects included. Raises ParameterError."""
    if not isinstance(content.parameters, dict):
        raise ParameterError("parameters must be an object of values by symbol")
    values = dict(content.parameters)
    for name, sizes in content.effects.items():
        if name not in CATALOGUE:
            raise ParameterError(f"unknown effect {name!r}: known are {', '.join(CATALOGUE)}")
        if not set(sizes) <= set(CATALOGUE[name]):
            raise ParameterError(f"effect {name} is sized by {', '.join(CATALOGUE[name])} only")
        values |= sizes
    return values


def _region(region: _RegionFields, centre: Parameters) -> Region:
    """The confidence region around the plant's parameters. Raises ParameterError and ValueError."""
    if region.joint is None:
        return Region(centre=centre, boxes=region.boxes)
    return Region(
        centre=centre,
        boxes=region.boxes,
        symbols=region.joint.symbols,
        covariance=np.array(region.joint.covariance, dtype=float),
        chi_square=region.joint.chi_square,
    )
