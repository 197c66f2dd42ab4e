"""Printed values of the report that no other file of this project holds (printed.json)."""

import json
from functools import cache
from importlib import resources
from typing import Any


@cache
def _data() -> dict[str, Any]:
    path = resources.files("identification.report_2003").joinpath("printed.json")
    return json.loads(path.read_text(encoding="utf-8"))


def correlation_matrix() -> list[list[float]]:
    """Table 4, rows and columns in the order I, U, p1, p2, p3."""
    return _data()["table4"]["matrix"]


def printed_sensitivities(table: int) -> dict[str, tuple[float, float]]:
    """Table 8 or 9: total errors for -10 % and +10 % by symbol [%]."""
    return {symbol: (minus, plus) for symbol, (minus, plus) in _data()[f"table{table}"].items()}


def printed_errors(table: int) -> dict[str, dict[str, float]]:
    """Table 11, 13 or 15: by test, the errors of p2, p3 and I and the partial error [%]."""
    return _data()[f"table{table}"]["tests"]


def printed_total(table: int) -> float:
    """Table 11's or 13's total error [%]."""
    return _data()[f"table{table}"]["total"]
