"""A folder of results with its options: a command continues the folder only under the same options."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from epv_env.common.json_files import write_json

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
    earlier = read_config(folder)
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


def read_config(folder: Path) -> dict[str, Any] | None:
    """The configuration in a folder, None if there is none. Raises ValueError if it is damaged."""
    path = folder / CONFIG
    if not path.exists():
        return None
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except json.JSONDecodeError as error:
        raise ValueError(
            f"{path} is damaged ({error}): remove the folder, or choose another --out"
        ) from None


def write_options(folder: Path, options: Mapping[str, Any]) -> None:
    """Write down what the folder's results depend on."""
    write_json(folder / CONFIG, options)
