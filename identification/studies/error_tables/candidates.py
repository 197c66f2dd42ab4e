"""The causes and the sizes at which each is tried: every effect, every parameter outside the four."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

from epv_env.plant.effects.coil import COPPER
from epv_env.plant.effects.registry import CATALOGUE
from epv_env.plant.parameters import Parameter, Parameters, table
from identification.studies.error_tables.bench_conditions import Conditions
from identification.studies.error_tables.patterns import Valve
from identification.studies.error_tables.recalibration import SYMBOLS

NONE = "none"
"""The valve that obeys the model; only the sensors' noise is left."""

BETWEEN_TESTS = "coil_heating:between_tests"
"""The winding is not equally warm in every test, as section 5.2.2 suspects."""

CURRENT_LAG = "current_sensor_lag"
"""A first-order filter in the current's measurement; not in the catalogue, for no model has it."""

ONE = (1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)
"""Shares of the way from off to an end of the domain, for an effect that one parameter sizes."""
SEVERAL = (1 / 16, 1 / 4, 1.0)
"""The same where several parameters size an effect; every combination is tried."""
BOTH_ENDS = (1 / 4, 1.0)
"""The same for one of several parameters that has two ends."""
ASIDE = (1 / 8, 1 / 4, 1 / 2, 1.0)
"""Shares of the way from a parameter's value to each end of its domain."""
WARMTHS = (2.5, 5.0, 10.0, 20.0, 40.0)
"""Largest departure of a test's winding from the mean of the tests [K]."""
LAGS = (2.5e-4, 5e-4, 1e-3, 2e-3, 4e-3)
"""Time constants of the current's measurement [s]."""


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One cause at one size."""

    cause: str
    changes: Mapping[str, float] = field(default_factory=dict)
    """Departures from Table 12 and section 6.1 by symbol [SI]."""
    warmth: float = 0.0
    """Scale of the winding's temperature departures from test to test [K]."""
    lag: float = 0.0
    """Time constant of the current's measurement [s]."""

    def valve(self, conditions: Conditions) -> Valve:
        """The valve with this cause, under given conditions."""
        n = len(conditions.cases)
        values = {symbol: [value] * n for symbol, value in self.changes.items()}
        if self.warmth:
            R = self.changes.get("R", Parameters.calibrated()["R"])
            values["R"] = [R * (1.0 + COPPER * self.warmth * w) for w in conditions.warmth]
        return Valve(values=values, current_lag=self.lag)

    def joined(self, other: "Candidate") -> "Candidate":
        """Both causes at once."""
        return Candidate(
            cause=f"{self.cause} + {other.cause}",
            changes={**self.changes, **other.changes},
            warmth=self.warmth + other.warmth,
            lag=self.lag + other.lag,
        )

    @property
    def departures(self) -> dict[str, float]:
        """How far each quantity is from where the cause is off, by name."""
        base = Parameters.calibrated()
        sizes = {symbol: value - base[symbol] for symbol, value in self.changes.items()}
        sizes |= {"warmth": self.warmth, "lag": self.lag}
        return {name: size for name, size in sizes.items() if size}

    def halfway(self, other: "Candidate") -> "Candidate | None":
        """The size between two neighbours of one quantity, in equal ratios; None if they are none."""
        near, far = self.departures, other.departures
        if self.cause != other.cause or len(near) != 1 or near.keys() != far.keys():
            return None
        ((name, a),), (b,) = near.items(), far.values()
        if a / b <= 0.0:
            return None
        middle = math.copysign(math.sqrt(a * b), a)
        if name in self.changes:
            value = Parameters.calibrated()[name] + middle
            return replace(self, changes={**self.changes, name: value})
        return replace(self, **{name: middle})

    @property
    def size(self) -> str:
        """Ready to read, with units."""
        parts = [f"{s} = {v:.3g} {table()[s].unit}".removesuffix(" 1") for s, v in self.changes.items()]
        parts += [f"±{self.warmth:.3g} K"] if self.warmth else []
        return ", ".join(parts + ([f"{1e3 * self.lag:.3g} ms"] if self.lag else []))


def candidates(causes: Sequence[str] | None = None) -> list[Candidate]:
    """Every cause at every size, or those of some causes and of none; a cause's stand together."""
    found = [Candidate(cause=NONE)]
    for name, symbols in CATALOGUE.items():
        found += [Candidate(cause=name, changes=changes) for changes in _sizes(symbols)]
    found += [Candidate(cause=BETWEEN_TESTS, warmth=warmth) for warmth in WARMTHS]
    found += [Candidate(cause=CURRENT_LAG, lag=lag) for lag in LAGS]
    for row in _uncertain_parameters():
        found += [
            Candidate(cause=f"parameter:{row.symbol}", changes={row.symbol: value})
            for value in _towards_the_ends(row, ASIDE)
        ]
    return [each for each in found if causes is None or each.cause in (NONE, *causes)]


def _sizes(symbols: Sequence[str]) -> list[dict[str, float]]:
    """Combinations of the sizes of an effect's parameters, that of all at rest left out."""
    base = Parameters.calibrated()
    if len(symbols) == 1:
        return [{symbols[0]: value} for value in _towards_the_ends(table()[symbols[0]], ONE)]
    grids = [[base[s], *_towards_the_ends(table()[s], _shares(s))] for s in symbols]
    return [dict(zip(symbols, values, strict=True)) for values in list(product(*grids))[1:]]


def _shares(symbol: str) -> Sequence[float]:
    return SEVERAL if Parameters.calibrated()[symbol] in (table()[symbol].domain or ()) else BOTH_ENDS


def _towards_the_ends(row: Parameter, shares: Sequence[float]) -> list[float]:
    start, ends = Parameters.calibrated()[row.symbol], row.domain or ()
    return [(1.0 - share) * start + share * end for end in ends if end != start for share in shares]


def _uncertain_parameters() -> list[Parameter]:
    """Rows of Tables 6 and 7 that were not calibrated and size no effect."""
    sizes = {symbol for symbols in CATALOGUE.values() for symbol in symbols}
    return [
        row
        for row in table().values()
        if row.source in ("Table 6", "Table 7") and row.symbol not in sizes.union(SYMBOLS)
    ]
