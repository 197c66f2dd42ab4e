"""The causes and the sizes at which each is tried: every effect, every parameter outside the four."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

from epv_env.plant.effects.coil import COPPER
from epv_env.plant.effects.registry import CATALOGUE
from epv_env.plant.parameters import Parameter, Parameters, table
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.studies.error_tables.bench_conditions import Conditions
from identification.studies.error_tables.error_prediction import HypotheticalValve
from identification.studies.error_tables.settings import DEFAULTS, ErrorTableSettings

NO_CAUSE = "none"
"""The valve that obeys the model; only the sensors' noise is left."""

BETWEEN_TESTS = "coil_heating:between_tests"
"""The winding is not equally warm in every test, as section 5.2.2 suspects."""

CURRENT_LAG = "current_sensor_lag"
"""A first-order filter in the current's measurement; it is not in the catalogue, as no model has it."""


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One cause at one size."""

    cause: str
    """An effect of the catalogue, `parameter:<symbol>`, NO_CAUSE, BETWEEN_TESTS or CURRENT_LAG."""
    changes: Mapping[str, float] = field(default_factory=dict)
    """Values that differ from Table 12 and section 6.1, by symbol [SI]."""
    winding_deviation: float = 0.0
    """Scale of the winding's temperature deviations from test to test [K]."""
    current_lag: float = 0.0
    """Time constant of the current's measurement [s]."""

    def valve(self, conditions: Conditions) -> HypotheticalValve:
        """The valve with this cause, under given conditions."""
        n = len(conditions.cases)
        values = {symbol: [value] * n for symbol, value in self.changes.items()}
        if self.winding_deviation:
            R = self.changes.get("R", Parameters.calibrated()["R"])
            values["R"] = [
                R * (1.0 + COPPER * self.winding_deviation * deviation)
                for deviation in conditions.winding_deviation
            ]
        return HypotheticalValve(values=values, current_lag=self.current_lag)

    def joined(self, other: "Candidate") -> "Candidate":
        """Both causes at once."""
        return Candidate(
            cause=f"{self.cause} + {other.cause}",
            changes={**self.changes, **other.changes},
            winding_deviation=self.winding_deviation + other.winding_deviation,
            current_lag=self.current_lag + other.current_lag,
        )

    @property
    def departures(self) -> dict[str, float]:
        """Each quantity less its value where the cause is off, by symbol or field name [SI]."""
        base = Parameters.calibrated()
        sizes = {symbol: value - base[symbol] for symbol, value in self.changes.items()}
        sizes |= {"winding_deviation": self.winding_deviation, "current_lag": self.current_lag}
        return {name: size for name, size in sizes.items() if size}

    def halfway(self, other: "Candidate") -> "Candidate | None":
        """The geometric mean of two sizes of one quantity; None if the two differ in another way."""
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
        """The sizes with their units, ready to read."""
        parts = [f"{s} = {v:.3g} {table()[s].unit}".removesuffix(" 1") for s, v in self.changes.items()]
        parts += [f"±{self.winding_deviation:.3g} K"] if self.winding_deviation else []
        parts += [f"{1e3 * self.current_lag:.3g} ms"] if self.current_lag else []
        return ", ".join(parts)


def candidates(
    causes: Sequence[str] | None = None, settings: ErrorTableSettings = DEFAULTS
) -> list[Candidate]:
    """Every cause at every size; the candidates of a cause stand together.

    causes: keep these and NO_CAUSE only; None keeps all.
    """
    every = [Candidate(cause=NO_CAUSE)]
    for name, symbols in CATALOGUE.items():
        sizes = _effect_sizes(symbols, settings)
        every += [Candidate(cause=name, changes=changes) for changes in sizes]
    every += [
        Candidate(cause=BETWEEN_TESTS, winding_deviation=deviation)
        for deviation in settings.winding_deviations
    ]
    every += [Candidate(cause=CURRENT_LAG, current_lag=lag) for lag in settings.current_lags]
    for row in _uncertain_parameters():
        every += [
            Candidate(cause=f"parameter:{row.symbol}", changes={row.symbol: value})
            for value in _values_towards_ends(row, settings.parameter_shares)
        ]
    return [each for each in every if causes is None or each.cause in (NO_CAUSE, *causes)]


def _effect_sizes(symbols: Sequence[str], settings: ErrorTableSettings) -> list[dict[str, float]]:
    """Combinations of the sizes of an effect's parameters, except the one with all parameters off."""
    if len(symbols) == 1:
        row = table()[symbols[0]]
        return [{row.symbol: value} for value in _values_towards_ends(row, settings.single_size_shares)]
    base = Parameters.calibrated()
    grids = [
        [base[symbol], *_values_towards_ends(table()[symbol], _combined_shares(symbol, settings))]
        for symbol in symbols
    ]
    return [dict(zip(symbols, values, strict=True)) for values in list(product(*grids))[1:]]


def _combined_shares(symbol: str, settings: ErrorTableSettings) -> Sequence[float]:
    one_sided = Parameters.calibrated()[symbol] in (table()[symbol].domain or ())
    return settings.combined_size_shares if one_sided else settings.combined_two_sided_shares


def _values_towards_ends(row: Parameter, shares: Sequence[float]) -> list[float]:
    """Values at these shares of the way from the calibrated value to each end of the range [SI]."""
    start, ends = Parameters.calibrated()[row.symbol], row.domain or ()
    return [(1.0 - share) * start + share * end for end in ends if end != start for share in shares]


def _uncertain_parameters() -> list[Parameter]:
    """Rows of Tables 6 and 7 that were not calibrated and size no effect."""
    sizes = {symbol for symbols in CATALOGUE.values() for symbol in symbols}
    return [
        row
        for row in table().values()
        if row.source in ("Table 6", "Table 7") and row.symbol not in sizes.union(CALIBRATED_SYMBOLS)
    ]
