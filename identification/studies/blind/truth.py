"""What is true in a trial: the valve as built, what ails it, and how its effects differ in form."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TypeVar

import numpy as np
from scipy.stats import truncnorm

from epv_env.plant.effects.registry import CATALOGUE
from epv_env.plant.parameters import Parameters
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.studies.blind.effect_draws import WARMEST, draw_parameter, draw_sizes
from identification.valve_gap.causes import PARAMETER_COMPONENTS

NONE, ONE, PAIR, LEFT_OUT = "none", "one", "pair", "left_out"

KINDS = (NONE,) * 10 + (ONE,) * 25 + (PAIR,) * 6 + (LEFT_OUT,) * 9
"""Kinds of every fifty trials: nothing, one cause, two effects, one effect that is struck out."""

PARAMETER = "parameter:"

EFFECTS = tuple(CATALOGUE)
SINGLES = EFFECTS * 3 + tuple(PARAMETER + symbol for symbol in PARAMETER_COMPONENTS)
"""Causes of trials with one: a parameter that is off comes up a third as often as an effect."""

CALIBRATED_SPREAD = 0.06
"""The four calibrated parameters lie within this share of Table 12's values, uniformly."""

SCATTER = 2e-3
"""Relative standard deviation of every other parameter from unit to unit, ..."""

FARTHEST = 2.0
"""... which lies no farther off than so many of them: what is built is inspected."""

DEVIATION = (0.03, 0.15)
"""How far an effect's form is from the fitted one, as a share of the effect (variants.py)."""

Card = TypeVar("Card")


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One trial's truth. SI units."""

    number: int
    kind: str
    effects: tuple[str, ...]
    """Names as in gap.json: effects of the catalogue, or `parameter:<symbol>`."""
    sizes: dict[str, float]
    """By symbol; of a parameter that is off, its value."""
    unit: Parameters
    """The valve as built, without what ails it."""
    deviation: float
    """Share by which the forms of the effects differ from the fitted ones; 0 without effects."""
    warmest: float = 0.0
    """How warm the winding becomes over the session, where it heats [K]."""

    @property
    def parameters(self) -> Parameters:
        """The valve with what ails it."""
        return self.unit.replace(**self.sizes)

    @property
    def struck(self) -> tuple[str, ...]:
        """What the diagnosis must do without."""
        return self.effects if self.kind == LEFT_OUT else ()

    def with_only(self, effect: str) -> "Trial":
        """The same valve with one of its two effects."""
        sizes = {symbol: self.sizes[symbol] for symbol in CATALOGUE[effect] if symbol in self.sizes}
        return Trial(
            number=self.number, kind=ONE, effects=(effect,), sizes=sizes, unit=self.unit,
            deviation=self.deviation, warmest=self.warmest if "h_coil" in sizes else 0.0,
        )  # fmt: skip


def plan(seed: int, trials: int) -> list[tuple[str, tuple[str, ...]]]:
    """Kind and causes of the first trials; more of them leave these as they are.

    Each deck is dealt out before it is shuffled anew, so every effect comes up equally often.
    """
    kinds, single, left_out, pair = (
        _dealt(deck, np.random.default_rng([seed, index, 1]))
        for index, deck in enumerate((KINDS, SINGLES, EFFECTS, EFFECTS))
    )
    found = []
    for kind in islice(kinds, trials):
        if kind == PAIR:
            first = next(pair)
            second = next(effect for effect in pair if effect != first)
            found.append((kind, (first, second)))
        elif kind == NONE:
            found.append((kind, ()))
        else:
            found.append((kind, (next(single if kind == ONE else left_out),)))
    return found


def draw_trial(seed: int, number: int, kind: str, causes: Sequence[str], attempt: int = 0) -> Trial:
    """The truth of one trial of a plan; attempt: sizes and unit anew, where no solver followed."""
    rng = np.random.default_rng([seed, number, *([attempt] if attempt else [])])
    unit = draw_unit(rng)
    sizes: dict[str, float] = {}
    for cause in causes:
        symbol = cause.removeprefix(PARAMETER)
        if symbol == cause:
            sizes |= draw_sizes(cause, rng)
        else:
            sizes[symbol] = draw_parameter(Parameters.calibrated()[symbol], rng)
    deviation, warmest = rng.uniform(*DEVIATION), np.exp(rng.uniform(*np.log(WARMEST)))
    return Trial(
        number=number,
        kind=kind,
        effects=tuple(causes),
        sizes=sizes,
        unit=unit,
        deviation=float(deviation) if set(causes) & set(CATALOGUE) else 0.0,
        warmest=float(warmest) if "h_coil" in sizes else 0.0,
    )


def draw_unit(rng: np.random.Generator) -> Parameters:
    """A valve as built."""
    centre = Parameters.calibrated()
    four = 1.0 + rng.uniform(-CALIBRATED_SPREAD, CALIBRATED_SPREAD, len(CALIBRATED_SYMBOLS))
    others = truncnorm.rvs(-FARTHEST, FARTHEST, size=len(PARAMETER_COMPONENTS), random_state=rng)
    factors = dict(zip(CALIBRATED_SYMBOLS, four, strict=True))
    factors |= dict(zip(PARAMETER_COMPONENTS, 1.0 + SCATTER * np.asarray(others), strict=True))
    return centre.replace(**{s: float(centre[s] * factor) for s, factor in factors.items()})


def _dealt(deck: Sequence[Card], rng: np.random.Generator) -> Iterator[Card]:
    """Cards without end: the deck shuffled, dealt out, shuffled again."""
    while True:
        yield from (deck[index] for index in rng.permutation(len(deck)))
