"""The plant file: parameters, effects and region as versioned JSON (docs/reference/files.md)."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import version
from os import PathLike
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from epv_env.common.extras import DISTRIBUTION
from epv_env.common.field_types import check_type
from epv_env.common.files import JSONFileError, checked, decoded, write_json
from epv_env.plant.channels import SENSORS, Sensor, changed_fields, own_sensors
from epv_env.plant.effects.law import SLOTS, SYMBOLS, Law, laws_of, placed
from epv_env.plant.effects.registry import CATALOGUE, LAWFUL, PLACES
from epv_env.plant.force_balance import check_valve
from epv_env.plant.free_parameters import FREE_PARAMETERS, Freedom, check_free
from epv_env.plant.parameters import ParameterError, Parameters
from epv_env.plant.region import Alternative, Mixture, Region

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
    diagnosis: Mixture | None = None
    """What a diagnosis holds possible; None where there was none."""
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

    def refitted(
        self, region: Region, name: str, *, diagnosis: Mixture | None = None, **provenance: object
    ) -> "Plant":
        """The valve with a region's centre for its parameters; provenance: what says where from."""
        return replace(
            self,
            parameters=region.centre,
            region=region,
            diagnosis=diagnosis,
            name=name,
            provenance={"software": f"{DISTRIBUTION} {version(DISTRIBUTION)}", **provenance},
        )


class _JointFields(msgspec.Struct):
    """Field `region.joint`: parameters that are uncertain together."""

    symbols: tuple[str, ...]
    covariance: list[list[float]]
    chi_square: float


class _RegionFields(msgspec.Struct):
    """Field `region`."""

    boxes: dict[str, tuple[float, float]] = {}
    joint: _JointFields | None = None


class _Values(msgspec.Struct, kw_only=True):
    """Parameters and their region; values are checked by `Parameters`, which names their domains."""

    parameters: Any
    effects: dict[str, dict[str, Any]] = {}
    laws: list[Law] = []
    region: _RegionFields = msgspec.field(default_factory=_RegionFields)
    name: str = "unnamed"


class _AlternativeFields(_Values):
    """An entry of field `alternatives`."""

    probability: float


class _PlantFile(_Values):
    """A plant file."""

    domains: dict[str, tuple[float, float]] = {}
    voltage_V: float = VOLTAGE
    sensors: dict[str, dict[str, float]] = {}
    free: dict[str, Freedom] | None = None
    alternatives: list[_AlternativeFields] = []
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
    expected = "a Plant, the path of a plant.json, or None"
    check_type("the plant", source, str | PathLike, PlantFileError, expected)
    return _plant(_content(Path(source)), f"plant file {Path(source)}")


def _content(path: Path) -> _PlantFile:
    """The file's content, its fields and their types checked. Raises PlantFileError."""
    remedy = "give the path of a plant.json, or write it anew"
    try:
        # `Parameters` refuses a NaN with the parameter's name.
        content = decoded(path, remedy=remedy, what="plant file", allow_nan=True)
    except JSONFileError as error:
        raise PlantFileError(str(error)) from None
    version_read = content.get("format") if isinstance(content, dict) else None
    if version_read != FORMAT:
        raise PlantFileError(
            f"plant file {path} has format {version_read!r}, this version reads {FORMAT!r}: write it "
            "anew with this version's identification"
        )
    try:
        return checked(content, _PlantFile, where=f"plant file {path}: content", remedy=REMEDY)
    except JSONFileError as error:
        raise PlantFileError(str(error)) from None


def save_plant(plant: Plant, path: str | PathLike[str]) -> None:
    """Write a plant file, whole or not at all."""
    write_json(path, {**_as_json(plant), "provenance": plant.provenance})


def plant_subject(plant: Plant) -> dict[str, Any]:
    """What results depend on, for a `Journal`: a plant but its provenance, and this version."""
    return {"software": version(DISTRIBUTION), "plant": _as_json(plant)}


def _as_json(plant: Plant) -> dict[str, Any]:
    """The fields of a plant file, but where its values come from."""
    content: dict[str, Any] = {
        "format": FORMAT,
        "name": plant.name,
        **_written(plant.parameters, plant.region),
        "domains": {symbol: list(ends) for symbol, ends in plant.parameters.own_domains.items()},
        "voltage_V": plant.voltage,
        "sensors": changed_fields(plant.sensors),
        "free": msgspec.json.decode(msgspec.json.encode(dict(plant.free))),
    }
    if plant.diagnosis is not None:
        content["alternatives"] = [
            {"name": alternative.name, "probability": alternative.probability}
            | _written(alternative.region.centre, alternative.region)
            for alternative in plant.diagnosis.alternatives
        ]
    return content


def _written(parameters: Parameters, region: Region) -> dict[str, Any]:
    """Fields `parameters`, `effects` and `region`."""
    effects = {
        name: {symbol: parameters[symbol] for symbol in symbols} for name, symbols in CATALOGUE.items()
    }
    sizing = {*SYMBOLS, *(symbol for symbols in CATALOGUE.values() for symbol in symbols)}
    uncertain: dict[str, Any] = {"boxes": {symbol: list(ends) for symbol, ends in region.boxes.items()}}
    if region.covariance is not None:
        uncertain["joint"] = {
            "symbols": list(region.symbols),
            "covariance": region.covariance.tolist(),
            "chi_square": region.chi_square,
        }
    return {
        "parameters": {s: value for s, value in parameters.items() if s not in sizing},
        "effects": {name: sizes for name, sizes in effects.items() if any(sizes.values())},
        "laws": [asdict(law) for law in laws_of(parameters, tuple(CATALOGUE))],
        "region": uncertain,
    }


def _plant(content: _PlantFile, place: str) -> Plant:
    """The plant that a file describes; place: how messages begin. Raises PlantFileError."""
    try:
        parameters = _parameters(content, content.domains)
        sensors = own_sensors(content.sensors)
        if content.domains or content.sensors or content.voltage_V != VOLTAGE:
            check_valve(parameters, content.voltage_V, sensors)
        if content.free is not None:
            check_free(content.free, parameters)
        return Plant(
            parameters=parameters,
            region=_region(content.region, parameters),
            diagnosis=Mixture(
                alternatives=tuple(_alternative(each, content) for each in content.alternatives)
            )
            if content.alternatives
            else None,
            name=content.name,
            provenance=content.provenance,
            voltage=content.voltage_V,
            sensors=sensors,
            free=FREE_PARAMETERS if content.free is None else content.free,
        )
    except ParameterError as error:
        raise PlantFileError(f"{place}: {error}") from None
    except ValueError as error:
        raise PlantFileError(f"{place}: {error}: {REMEDY}") from None


def _alternative(entry: _AlternativeFields, content: _PlantFile) -> Alternative:
    """One of the alternatives. Raises ParameterError and ValueError."""
    try:
        region = _region(entry.region, _parameters(entry, content.domains))
    except ValueError as error:
        raise type(error)(f"alternative {entry.name!r}: {error}") from None
    return Alternative(name=entry.name, probability=entry.probability, region=region)


def _parameters(content: _Values, domains: Mapping[str, tuple[float, float]]) -> Parameters:
    """All parameters, those of effects and laws included; the report's where none are given.

    Raises ParameterError.
    """
    if not isinstance(content.parameters, dict):
        raise ParameterError("parameters must be an object of values by symbol")
    values = dict(content.parameters)
    for name, sizes in content.effects.items():
        if name not in CATALOGUE:
            raise ParameterError(f"unknown effect {name!r}: known are {', '.join(CATALOGUE)}")
        if not set(sizes) <= set(CATALOGUE[name]):
            raise ParameterError(f"effect {name} is sized by {', '.join(CATALOGUE[name])} only")
        values |= sizes
    if len(content.laws) > len(SLOTS):
        raise ParameterError(f"laws has {len(content.laws)} entries: give at most {len(SLOTS)}")
    for slot, law in zip(SLOTS, content.laws, strict=False):
        lawful = sorted(set(LAWFUL.values()))
        if law.effect not in lawful:
            raise ParameterError(f"law of {law.effect!r}: choose one of {', '.join(lawful)}")
        values |= placed(slot, PLACES[law.effect], law.argument, law.low, law.high, law.growth)
    return Parameters({**Parameters.calibrated(), **values}, domains)


def _region(region: _RegionFields, centre: Parameters) -> Region:
    """The confidence region around the plant's parameters. Raises ParameterError and ValueError."""
    joint: dict[str, Any] = msgspec.structs.asdict(region.joint) if region.joint else {}
    if joint:
        joint["covariance"] = np.array(joint["covariance"], dtype=float)
    return Region(centre=centre, boxes=region.boxes, **joint)
