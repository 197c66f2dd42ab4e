"""Writing results: JSON files, and tables as records."""

import json
from pathlib import Path
from typing import Any

import pandas as pd

from epv_env.common.files import write_text


def write_json(path: Path, content: Any) -> None:
    """Write content as indented JSON."""
    write_text(path, json.dumps(content, indent=1) + "\n")


def records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """A table's rows as dictionaries, as JSON takes them."""
    return table.to_dict("records")  # type: ignore[return-value]
