"""Sizes of a diagnosed cause, compared with the true ones."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from epv_env.plant.parameters import Parameters


@dataclass(frozen=True, kw_only=True)
class SizeEstimate:
    """One diagnosed size of a correct cause."""

    symbol: str
    """Of the parameter that holds the size."""
    error: float
    """|diagnosed - true| over |true - value of the nominal model| [-]."""
    inside: bool
    """Whether the diagnosed interval holds the true size."""


def size_estimates(label: Mapping[str, Any], cause: Mapping[str, Any]) -> list[SizeEstimate]:
    """The sizes of a diagnosed cause of gap.json that the label of sealed.json knows."""
    estimates = []
    nominal = Parameters.calibrated()
    for symbol, (value, low, high) in _size_intervals(cause).items():
        if symbol in label["sizes"]:
            true = label["sizes"][symbol]
            error = abs(value - true) / abs(true - nominal[symbol])
            inside = low <= true <= high
            estimates.append(SizeEstimate(symbol=symbol, error=error, inside=inside))
    return estimates


def estimated_sizes(cause: Mapping[str, Any]) -> dict[str, float]:
    """Estimated sizes of a cause by symbol [SI]."""
    return {symbol: interval[0] for symbol, interval in _size_intervals(cause).items()}


def _size_intervals(cause: Mapping[str, Any]) -> dict[str, Any]:
    """Estimate, low and high end of each size of a cause by symbol; gap.json has symbol_unit."""
    symbols = sorted(Parameters.calibrated(), key=len)
    intervals = {}
    for name, interval in cause.get("magnitude", {}).items():
        matching = [symbol for symbol in symbols if f"{name}_".startswith(f"{symbol}_")]
        if matching:
            intervals[matching[-1]] = interval
    return intervals
