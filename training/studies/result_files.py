"""Tables as records, which JSON takes."""

from typing import Any

import pandas as pd


def records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """A table's rows as dictionaries, as JSON takes them."""
    return table.to_dict("records")  # type: ignore[return-value]
