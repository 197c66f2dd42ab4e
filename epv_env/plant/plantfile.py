"""The plant file: parameters, effects and confidence region as versioned JSON (docs/data.md)."""

import json
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from epv_env.common.files import write_text
from epv_env.plant.effects.registry import CATALOGUE
from epv_env.plant.parameters import ParameterError, Parameters
from epv_env.plant.region import Region

FORMAT = "epv-plant/1"


class PlantFileError(ValueError):
    """A plant file cannot be read: the message names file, fault and remedy."""


@dataclass(frozen=True, kw_only=True)
class Plant:
    """A calibrated plant: its best parameters and, if identification found it, its joint region."""

    parameters: Parameters
    region: Region
    """What the calibration leaves uncertain; Table 14's intervals where nothing better is known."""
    name: str = "calibrated"
    provenance: dict[str, Any] = field(default_factory=dict)
    """Where the values come from (recordings, hashes, versions); free-form."""

    @classmethod
    def calibrated(cls) -> "Plant":
        """The report's own calibration: Table 12, with Table 14 as its region."""
        parameters = Parameters.calibrated()
        return cls(
            parameters=parameters,
            region=Region.named("confidence", parameters),
            provenance={"source": "SCL-001/2003, Tables 5-7, 12 and 14"},
        )


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
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise PlantFileError(
            f"cannot read plant file {path}: {error.strerror}; give the path of a plant.json"
        ) from None
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise PlantFileError(f"plant file {path} is not JSON ({error}); write it anew") from None
    found = content.get("format") if isinstance(content, dict) else None
    if found != FORMAT:
        raise PlantFileError(
            f"plant file {path} has format {found!r}, this version reads {FORMAT!r}: write it anew "
            "with this version's identification"
        )
    try:
        return _decode(content)
    except ParameterError as error:
        raise PlantFileError(f"plant file {path}: {error}") from None
    except KeyError as error:
        raise PlantFileError(f"plant file {path}: field {error} is missing: add it") from None
    except (TypeError, ValueError, AttributeError) as error:
        raise PlantFileError(
            f"plant file {path} is not of the form that docs/data.md describes ({error})"
        ) from None


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
    write_text(Path(path), json.dumps(content, indent=1) + "\n")


def _decode(content: dict[str, Any]) -> Plant:
    given = content["parameters"]
    if not isinstance(given, dict):
        raise ParameterError("parameters must be an object of values by symbol")
    for name, sizes in content.get("effects", {}).items():
        if name not in CATALOGUE:
            raise ParameterError(f"unknown effect {name!r}: known are {', '.join(CATALOGUE)}")
        if not set(sizes) <= set(CATALOGUE[name]):
            raise ParameterError(f"effect {name} is sized by {', '.join(CATALOGUE[name])} only")
        given = {**given, **sizes}
    parameters = Parameters.calibrated().replace(**given)
    region = content.get("region", {})
    boxes = {
        symbol: (float(low), float(high)) for symbol, (low, high) in region.get("boxes", {}).items()
    }
    joint = region.get("joint")
    if joint is None:
        decoded = Region(centre=parameters, boxes=boxes)
    else:
        decoded = Region(
            centre=parameters,
            boxes=boxes,
            symbols=tuple(joint["symbols"]),
            covariance=np.array(joint["covariance"], dtype=float),
            chi_square=float(joint["chi_square"]),
        )
    return Plant(
        parameters=parameters,
        region=decoded,
        name=str(content.get("name", "unnamed")),
        provenance=dict(content.get("provenance", {})),
    )
