"""A folder of results with its options: a command continues the folder only under the same options."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from epv_env.common.json_files import checked, decoded, write_json

Shape = TypeVar("Shape")

CONFIG = "config.json"


def check_options(folder: Path, options: Mapping[str, Any], what: str) -> None:
    """Check that a folder, if it was begun, was begun with these options.

    Args:
        folder: of the results.
        options: all that the results depend on, as JSON gives it back.
        what: the results, in a word.

    Raises:
        ValueError: the folder was begun with other options, or its configuration cannot be read.
    """
    earlier = read_config(folder, dict[str, Any])
    if earlier is not None:
        check_same(earlier, options, f"{folder} holds a {what} with", "go on with the same")


def check_same(
    earlier: Mapping[str, Any], options: Mapping[str, Any], subject: str, remedy: str
) -> None:
    """Raises ValueError if an earlier run had another value of one of these options.

    subject, remedy: begin and end the sentence, as in "runs/a holds a sweep with" (seed 0, not 1) and
    "go on with the same".
    """
    for name, value in options.items():
        if earlier.get(name) != value:
            raise ValueError(
                f"{subject} {name} {earlier.get(name)}, not {value}: {remedy}, or choose another --out"
            )


def read_config(folder: Path, shape: type[Shape]) -> Shape | None:
    """The configuration in a folder as a `shape`, None if there is none.

    Raises JSONFileError if it is damaged or of another shape.
    """
    path = folder / CONFIG
    if not path.exists():
        return None
    remedy = "remove the folder, or choose another --out"
    return checked(decoded(path, remedy=remedy), shape, where=str(path), remedy=remedy)


def write_options(folder: Path, options: Mapping[str, Any]) -> None:
    """Write down what the folder's results depend on."""
    write_json(folder / CONFIG, options)
