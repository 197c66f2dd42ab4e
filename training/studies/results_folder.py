"""A folder of results: it is gone on with only under the options that it was begun with."""

import json
from pathlib import Path
from typing import Any

from epv_env.common.files import write_text

CONFIG = "config.json"


def check_options(folder: Path, options: dict[str, Any], what: str) -> None:
    """Raises ValueError if the folder was begun with other options, or what it says cannot be read.

    options: all that the results depend on, as JSON gives it back. what: the results, in a word.
    """
    path = folder / CONFIG
    try:
        earlier = json.loads(path.read_text(encoding="utf-8")) if path.exists() else options
    except json.JSONDecodeError as error:
        raise ValueError(
            f"{path} is damaged ({error}): remove the folder, or choose another --out"
        ) from None
    for name, value in options.items():
        if earlier.get(name) != value:
            raise ValueError(
                f"{folder} holds a {what} with {name} {earlier.get(name)}, not {value}: go on with the "
                "same, or choose another --out"
            )


def write_options(folder: Path, options: dict[str, Any]) -> None:
    """Write down what the folder's results depend on."""
    write_text(folder / CONFIG, json.dumps(options, indent=1) + "\n")
