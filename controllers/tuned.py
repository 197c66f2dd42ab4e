"""The tuned controllers as data (tuned.json): the values that the search found, and how it searched."""

from dataclasses import asdict, dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from controllers.base import Controller
from controllers.knowledge import WITH_RULES, with_rules
from controllers.registry import registration
from epv_env.common.files import JSONFileError, read_json, write_json
from epv_env.plant.plantfile import Plant

FORMAT = "epv-controllers/1"
TUNED_FILE = Path(__file__).parent / "tuned.json"
"""The tunings that come with the package."""


class ControllersFileError(ValueError):
    """A file of tuned controllers cannot be used."""


@dataclass(frozen=True, kw_only=True)
class Tuning:
    """The outcome of one search."""

    values: dict[str, int | float]
    """The searched quantities by name (the search space of controllers/registration.py)."""
    trials: int
    """Evaluations spent."""
    mean_return: float
    """Mean return of the best on the tuning scenarios."""
    episodes: int
    """Episodes of one evaluation."""
    plants: str = "sensitive_ten_percent"
    """Region of the plants that it was searched on (epv_env.plant.region)."""


@dataclass(frozen=True, kw_only=True)
class TuningsFile:
    """The content of a file of tuned controllers."""

    search: dict[str, Any]
    """How the tunings were searched: method, budget, seed, plants."""
    controllers: dict[str, Tuning]
    """Tunings by the controllers' kinds."""


def load_tunings(path: str | PathLike[str] | None = None) -> dict[str, Tuning]:
    """Tunings by name, from a file or (None) those that come with the package.

    Raises ControllersFileError.
    """
    return _content(path).controllers


def load_search(path: str | PathLike[str] | None = None) -> dict[str, Any]:
    """How the tunings of such a file were searched. Raises ControllersFileError."""
    return _content(path).search


def _content(path: str | PathLike[str] | None) -> TuningsFile:
    remedy = "tune anew with `epv tune`"
    try:
        return read_json(path or TUNED_FILE, TuningsFile, version=FORMAT, remedy=remedy)
    except JSONFileError as error:
        raise ControllersFileError(str(error)) from None


def save_tunings(tunings: dict[str, Tuning], path: str | PathLike[str], search: dict[str, Any]) -> None:
    """Write tunings and how they were searched, whole or not at all."""
    content = {"format": FORMAT, **asdict(TuningsFile(search=search, controllers=tunings))}
    write_json(path, content)


def build(name: str, values: dict[str, Any], plant: Plant) -> Controller:
    """A controller from its tuned quantities.

    Args:
        name: one of the registry's kinds, perhaps followed by WITH_RULES.
        values: tuned quantities by name.
        plant: that it is designed for.

    Raises:
        ValueError: the kind is unknown, a quantity is missing or unknown, or quantities contradict each
            other.
    """
    controller = registration(name.removesuffix(WITH_RULES)).built(values, plant)
    return with_rules(controller, plant) if name.endswith(WITH_RULES) else controller


def tuned(name: str, plant: Plant | None = None) -> Controller:
    """`build` with the tuning that comes with the package; plant None: the report's calibration."""
    values = load_tunings()[name.removesuffix(WITH_RULES)].values
    return build(name, values, plant or Plant.calibrated())
