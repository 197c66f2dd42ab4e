"""Regions of parameter space from which plants are drawn: fixed, boxes, ellipsoids, and mixtures."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.parameters import (
    ParameterError,
    Parameters,
    checked_value,
    confidence_intervals,
    sensitive_symbols,
    written_value,
)

CALIBRATED_SYMBOLS = ("alphaMV", "alphaPV", "RML", "R")
"""The four parameters that the report calibrates (Tables 10, 12, 14)."""

REGIONS = ("exact", "confidence", "ten_percent", "sensitive_ten_percent", "domain")
"""Named regions around a plant (`Region.named`)."""
DIAGNOSIS = "diagnosis"
"""Name of the mixture that a plant file may hold beside its region."""


@dataclass(frozen=True, kw_only=True)
class Region:
    """Plants around a centre. Empty boxes and covariance: the centre alone."""

    centre: Parameters
    """Parameters in the middle of the region [SI]."""
    boxes: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Symbols that vary on their own, uniformly between two ends (SI units)."""
    symbols: tuple[str, ...] = ()
    """Symbols that vary jointly, uniformly in the ellipsoid of `covariance` around the centre."""
    covariance: NDArray | None = None
    """Covariance of the joint symbols, shape (k, k), SI units."""
    chi_square: float = 0.0
    """Squared Mahalanobis radius of the ellipsoid (for 95 % of four parameters: 9.49)."""

    def __post_init__(self) -> None:
        for symbol, (low, high) in self.boxes.items():
            if not low <= high:
                raise ParameterError(f"range of {symbol} is [{low:g}, {high:g}]: give low <= high")
            checked_value(symbol, low, self.centre.own_domains)
            checked_value(symbol, high, self.centre.own_domains)
        if self.covariance is not None:
            self._check_joint(self.covariance)

    def _check_joint(self, covariance: NDArray) -> None:
        k = len(self.symbols)
        for symbol in self.symbols:
            checked_value(symbol, self.centre.get(symbol, np.nan), self.centre.own_domains)
        proper = (
            covariance.shape == (k, k)
            and bool(np.all(np.isfinite(covariance)))
            and np.allclose(covariance, covariance.T, rtol=1e-9, atol=0.0)
            and bool(np.all(np.diag(covariance) >= 0))
            and bool(np.all(np.linalg.eigvalsh(correlation(covariance)) >= -1e-9))
        )
        if not proper:
            raise ParameterError(
                f"the joint region's covariance must be a symmetric, positive semi-definite {k} x {k} "
                f"matrix, one row per symbol of {self.symbols}"
            )
        if not 0 <= self.chi_square < np.inf:
            raise ParameterError(f"the joint region's chi_square = {self.chi_square} must be >= 0")

    @property
    def varies(self) -> bool:
        """Whether there is anything to draw."""
        return bool(self.boxes) or self.covariance is not None

    @classmethod
    def named(cls, name: str, centre: Parameters) -> "Region":
        """One of REGIONS around the centre.

        "confidence": Table 14's intervals, moved to the centre; "ten_percent": +-10 % of the four
        calibrated parameters; "sensitive_ten_percent": +-10 % of every parameter that Tables 8 and 9
        class as Sensitive; "domain": the full domains of the four.
        """
        if name == "exact":
            return cls(centre=centre)
        if name == "confidence":
            shift = {s: centre[s] - Parameters.calibrated()[s] for s in CALIBRATED_SYMBOLS}
            intervals = confidence_intervals().items()
            boxes = {s: _cut(centre, s, low + shift[s], high + shift[s]) for s, (low, high) in intervals}
        elif name == "ten_percent":
            boxes = _relative(centre, CALIBRATED_SYMBOLS, 0.1)
        elif name == "sensitive_ten_percent":
            boxes = _relative(centre, sensitive_symbols(), 0.1)
        elif name == "domain":
            boxes = {s: centre.domain(s) for s in CALIBRATED_SYMBOLS}
        else:
            raise ParameterError(
                f"unknown parameter region {name!r}: choose one of {', '.join((*REGIONS, DIAGNOSIS))}, "
                "or give values and (low, high) ranges by symbol"
            )
        return cls(centre=centre, boxes=boxes)

    def changed(self, choices: Mapping[str, Any]) -> "Region":
        """The region with exact values and (low, high) ranges by symbol instead of its own."""
        domains = self.centre.own_domains
        exact: dict[str, float] = {}
        boxes: dict[str, tuple[float, float]] = {}
        for symbol, choice in choices.items():
            if isinstance(choice, (tuple, list, np.ndarray)):
                if len(choice) != 2:
                    raise ParameterError(f"range of {symbol} is {choice!r}: give (low, high)")
                low, high = (written_value(symbol, end, domains) for end in choice)
                boxes[symbol] = (low, high)
            else:
                exact[symbol] = written_value(symbol, choice, domains)
        left = {symbol: ends for symbol, ends in self.boxes.items() if symbol not in choices}
        joint = [i for i, symbol in enumerate(self.symbols) if symbol not in choices]
        block = np.ix_(joint, joint)
        return Region(
            centre=self.centre.replace(**exact),
            boxes={**left, **boxes},
            symbols=tuple(self.symbols[i] for i in joint),
            covariance=self.covariance[block] if self.covariance is not None and joint else None,
            chi_square=self.chi_square,
        )

    def chosen(self, rng: np.random.Generator) -> "Region":
        """The region itself, as `Mixture.chosen` gives one of several; nothing is drawn."""
        return self

    def draw(self, rng: np.random.Generator) -> Parameters:
        """One plant of the region."""
        changes = dict(zip(self.boxes, rng.uniform(*self._ends).tolist(), strict=True))
        if self.covariance is not None:
            k = len(self.symbols)
            direction = rng.standard_normal(k)
            ball = direction * rng.uniform() ** (1 / k) / np.linalg.norm(direction)
            changes |= dict(zip(self.symbols, self.joint(ball[None])[0].tolist(), strict=True))
        return self.centre.replace_unchecked(changes)  # a box or an ellipsoid within the domains

    def towards_ends(self, plant: Parameters) -> Parameters:
        """A plant of the region with the symbols of the boxes moved towards the ends of their ranges.

        A uniform draw between the ends becomes one with density 1 / (share (1 - share))^0.6, the beta
        distribution of 0.4 and 0.4: half of the draws lie within a tenth of the range from an end.
        """
        from scipy.special import betaincinv  # takes a third of the environment's import

        symbols = [symbol for symbol, (low, high) in self.boxes.items() if low < high]
        if not symbols:
            return plant
        low, high = np.transpose([self.boxes[symbol] for symbol in symbols])
        share = (np.array([plant[symbol] for symbol in symbols]) - low) / (high - low)
        moved = low + (high - low) * betaincinv(0.4, 0.4, np.clip(share, 0.0, 1.0))
        return plant.replace_unchecked(dict(zip(symbols, moved.tolist(), strict=True)))

    @cached_property
    def _ends(self) -> NDArray:
        """Lower and upper ends of the boxes (2, boxes) [SI]."""
        return np.array(list(self.boxes.values())).reshape(-1, 2).T

    def joint(self, ball: NDArray) -> NDArray:
        """Points of the ellipsoid (points, k) for those of the unit ball; kept inside the domains [SI].

        Uniform points of the ball give uniform ones of the ellipsoid.
        """
        if self.covariance is None:
            return ball  # without coordinates, since there are no joint symbols
        variances, axes = np.linalg.eigh(correlation(self.covariance))
        offset = (ball * np.sqrt(np.maximum(variances, 0))) @ axes.T
        offset *= np.sqrt(self.chi_square * np.diag(self.covariance))
        low, high = np.transpose([self.centre.domain(s) for s in self.symbols])
        return np.clip([self.centre[s] for s in self.symbols] + offset, low, high)


@dataclass(frozen=True, kw_only=True)
class Alternative:
    """One of the plants that a valve may be."""

    name: str
    """What it says about the valve, such as the effects that act."""
    probability: float
    """That it is the right one [1]."""
    region: Region
    """Its plants."""


@dataclass(frozen=True, kw_only=True)
class Mixture:
    """Plants of which nobody knows what acts in them: alternatives, each with its probability."""

    alternatives: tuple[Alternative, ...]

    def __post_init__(self) -> None:
        for a in self.alternatives:
            if not 0 < a.probability <= 1:
                raise ParameterError(
                    f"alternative {a.name!r} has probability {a.probability:g}: give one above 0 "
                    "and at most 1"
                )
        whole = sum(a.probability for a in self.alternatives)
        if abs(whole - 1) > 1e-6:  # they were written in decimals
            raise ParameterError(f"the alternatives' probabilities have the sum {whole:g}: make it 1")

    @cached_property
    def _ends(self) -> NDArray:
        """Probability of each alternative and those before it (alternatives,) [1]."""
        return np.cumsum([a.probability for a in self.alternatives])

    @property
    def centre(self) -> Parameters:
        """Centre of the first alternative [SI]."""
        return self.alternatives[0].region.centre

    def changed(self, choices: Mapping[str, Any]) -> "Mixture":
        """`Region.changed` in every alternative."""
        return Mixture(
            alternatives=tuple(replace(a, region=a.region.changed(choices)) for a in self.alternatives)
        )

    def chosen(self, rng: np.random.Generator) -> Region:
        """The region of an alternative, drawn by the probabilities."""
        last = len(self.alternatives) - 1  # the sum may be below 1 by rounding
        return self.alternatives[min(int(np.searchsorted(self._ends, rng.random())), last)].region


def correlation(covariance: NDArray) -> NDArray:
    """The correlation matrix: free of units, whose magnitudes differ by more than a float's digits."""
    deviation = np.sqrt(np.diag(covariance))
    deviation = np.where(deviation > 0, deviation, 1.0)
    return covariance / np.outer(deviation, deviation)


def _relative(
    centre: Parameters, symbols: tuple[str, ...], share: float
) -> dict[str, tuple[float, float]]:
    """Boxes of +-share around the centre, cut at the domains."""
    return {s: _cut(centre, s, centre[s] * (1 - share), centre[s] * (1 + share)) for s in symbols}


def _cut(centre: Parameters, symbol: str, low: float, high: float) -> tuple[float, float]:
    """The interval within the symbol's domain."""
    least, greatest = centre.domain(symbol)
    return float(np.clip(low, least, greatest)), float(np.clip(high, least, greatest))
