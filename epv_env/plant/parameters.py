"""The parameters of the valve: the rows of Tables 5-7 and the sets of values made from them."""

import json
from collections.abc import Iterator, Mapping, ValuesView
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType
from typing import Any

import numpy as np

from epv_env.common.field_types import check_type
from epv_env.common.units import BAR
from epv_env.plant.effects import law
from epv_env.plant.effects.registry import EFFECTS


class ParameterError(ValueError):
    """A parameter is unknown, not a number, or outside the domain in which the model means anything."""


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One row of the report's parameter tables. Units are SI."""

    symbol: str
    """Symbol of docs/explanation/plant-model.md."""
    unit: str
    """SI unit; "1" for none."""
    value: float
    """Nominal value [unit]."""
    domain: tuple[float, float] | None
    """Expected range (Tables 6, 7) of the report's valve; None for a physical constant."""
    possible: tuple[float, float] | None
    """Range of any valve of this kind, within which a plant's own domain must lie; None: a constant."""
    group: str
    """'known', 'partially known', 'unknown' (section 5.1), 'unmodelled' or 'environment'."""
    sensitive: bool
    """Whether Tables 8 and 9 class the model as sensitive to it."""
    source: str
    """Table or equation of the report, or the effect."""
    meaning: str
    """What the parameter is, in a line."""

    def __post_init__(self) -> None:
        for name in ("domain", "possible"):
            ends = getattr(self, name)
            object.__setattr__(self, name, ends and tuple(ends))  # JSON has lists


Domains = Mapping[str, tuple[float, float]]
"""Least and greatest value by symbol [SI]."""

_REPORTS: Domains = MappingProxyType({})
"""Own domains of the report's valve: none, the table's hold."""


@cache
def _data() -> dict[str, Any]:
    text = resources.files("epv_env.plant").joinpath("parameters.json").read_text(encoding="utf-8")
    return json.loads(text)


@cache
def table() -> Mapping[str, Parameter]:
    """Every parameter by its symbol: the report's in order, then sizes of effects and laws."""
    rows = [Parameter(**row) for row in _data()["parameters"]]
    sizes = [(f"effect {effect.name}", size) for effect in EFFECTS for size in effect.sizes]
    sizes += [("law of an effect", size) for size in law.sizes(EFFECTS)]
    rows += [
        Parameter(
            symbol=size.symbol, unit=size.unit, value=0.0, domain=size.domain,
            possible=size.domain, group="unmodelled", sensitive=False, source=source,
            meaning=size.meaning,
        )
        for source, size in sizes
        if size.domain
    ]  # fmt: skip
    return MappingProxyType({row.symbol: row for row in rows})


def sensitive_symbols() -> tuple[str, ...]:
    """Symbols that Tables 8 and 9 class as Sensitive."""
    return tuple(symbol for symbol, row in table().items() if row.sensitive)


def confidence_intervals() -> dict[str, tuple[float, float]]:
    """The 95 % intervals of Table 14 for the four calibrated parameters."""
    return {symbol: (low, high) for symbol, (low, high) in _data()["confidence95"]["intervals"].items()}


def checked_value(symbol: str, value: Any, domains: Domains = _REPORTS) -> float:
    """The value as a float, if `symbol` exists and its domain holds it; else ParameterError.

    domains: those of the plant that replace the table's [SI].
    """
    row = _row(symbol)
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise ParameterError(f"parameter {symbol} is {value!r}: give one number [{row.unit}]")
    low, high = domains.get(symbol, row.domain or (row.value, row.value))
    if not low <= value <= high:
        source = "the plant's own" if symbol in domains else row.source
        raise ParameterError(
            f"parameter {symbol} = {value:g} {row.unit} is outside its domain "
            f"[{low:g}, {high:g}] ({source}): {_remedy(row, symbol in domains)}"
        )
    return float(value)


def _row(symbol: str) -> Parameter:
    row = table().get(symbol)
    if row is None:
        raise ParameterError(f"unknown parameter {symbol!r}: known symbols are {', '.join(table())}")
    return row


def _remedy(row: Parameter, own: bool) -> str:
    """What to do about a value outside its domain; own: the domain is the plant's own."""
    if row.domain is None:
        return "leave this constant out"
    if own or row.possible == row.domain:
        return "give a value inside it"
    return "give a value inside it, or for another valve its own domain in a plant file's `domains`"


def checked_domain(symbol: str, ends: tuple[float, float]) -> tuple[float, float]:
    """A plant's own domain [SI], if a valve of this kind may have it; else ParameterError."""
    check_type(f"the domain of {symbol}", ends, tuple[float, float], ParameterError)
    row, (low, high) = _row(symbol), ends
    if row.possible is None:
        raise ParameterError(f"{symbol} is a constant and has no domain: leave it out")
    least, greatest = row.possible
    if not least <= low < high <= greatest:
        raise ParameterError(
            f"the domain [{low:g}, {high:g}] {row.unit} of {symbol} is none of a valve of this kind, "
            f"whose {row.meaning} lies in [{least:g}, {greatest:g}] {row.unit}: give low < high "
            "inside, in SI units"
        )
    return float(low), float(high)


def written_value(symbol: str, value: Any, domains: Domains = _REPORTS) -> float:
    """`checked_value` of what a person wrote: a pressure in bar is refused too (ParameterError)."""
    checked = checked_value(symbol, value, domains)
    # The sensors' range is 16 bar, so a smaller number is one in bar.
    if table()[symbol].unit == "Pa" and 0 < abs(checked) <= 16.0:
        raise ParameterError(
            f"parameter {symbol} = {checked:g} is in Pa, and {checked:g} Pa is less than a sensor "
            f"resolves: write {checked * BAR:g} if you mean {checked:g} bar"
        )
    return checked


class Parameters(Mapping[str, float]):
    """An immutable, complete and checked set of values by symbol, with the domains of its valve.

    >>> Parameters.calibrated().replace(alphaMV=0.7)["alphaMV"]
    0.7
    """

    def __init__(self, values: Mapping[str, float], own_domains: Domains = _REPORTS):
        """Check the values and the domains in which they must lie.

        Args:
            values: a value for every symbol of `table()` [SI].
            own_domains: domains of this valve that replace the table's [SI].

        Raises:
            ParameterError: a symbol is missing, unknown, or has a value or domain that cannot be.
        """
        check_type("Parameters: values", values, Mapping, ParameterError)
        check_type("Parameters: own_domains", own_domains, Mapping, ParameterError)
        missing = [symbol for symbol in table() if symbol not in values]
        if missing:
            raise ParameterError(f"missing parameters: {', '.join(missing)}: give every symbol")
        domains = {symbol: checked_domain(symbol, ends) for symbol, ends in own_domains.items()}
        checked = {symbol: checked_value(symbol, value, domains) for symbol, value in values.items()}
        self._values = {symbol: checked[symbol] for symbol in table()}
        self._own_domains: Domains = domains

    @classmethod
    def nominal(cls) -> "Parameters":
        """The values of Tables 5-7, on which the report's sensitivity study stands."""
        return cls({symbol: row.value for symbol, row in table().items()})

    @classmethod
    def calibrated(cls) -> "Parameters":
        """Table 12's estimates with the cone model removed (section 6.1): the default plant."""
        return cls.nominal().replace(**_data()["calibrated"]["values"])

    @classmethod
    def initial_guess(cls) -> "Parameters":
        """Table 10: where the report's calibration started."""
        return cls.nominal().replace(**_data()["initial_guess"]["values"])

    def replace(self, **changes: float) -> "Parameters":
        """A copy with some values changed. Raises ParameterError."""
        return self.replace_unchecked(
            {s: checked_value(s, value, self._own_domains) for s, value in changes.items()}
        )

    def replace_unchecked(self, changes: Mapping[str, float]) -> "Parameters":
        """A copy with values changed by symbol that are inside their domains already."""
        changed = Parameters.__new__(Parameters)
        changed._values = {**self._values, **changes}
        changed._own_domains = self._own_domains
        return changed

    @property
    def own_domains(self) -> Domains:
        """Domains [SI] of this valve that replace the table's; empty for the report's."""
        return self._own_domains

    def domain(self, symbol: str) -> tuple[float, float]:
        """Least and greatest value [SI]: its own domain, else the table's; a constant's value twice."""
        row = table()[symbol]
        return self._own_domains.get(symbol, row.domain or (row.value, row.value))

    def values(self) -> ValuesView[float]:
        """The values in the order of `table()`."""
        return self._values.values()

    def __getitem__(self, symbol: str) -> float:
        return self._values[symbol]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        return f"Parameters({self._values})"
