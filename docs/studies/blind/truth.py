"""The truth of a trial: the valve as built, the causes of its gap, and how their forms deviate."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import TypeVar

import numpy as np
from scipy.stats import truncnorm

from docs.studies.blind.forms import OTHER_FORMS
from epv_env.plant.effects.registry import CATALOGUE, effect
from epv_env.plant.parameters import Parameters
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.valve_gap.causes import PARAMETER_COMPONENTS

NOMINAL, ONE_CAUSE, TWO_EFFECTS, EXCLUDED_EFFECT = "none", "one", "pair", "left_out"
"""Kinds as drawn.

NOMINAL: no cause. ONE_CAUSE: one effect, or one parameter off its value. TWO_EFFECTS: two effects at
once. EXCLUDED_EFFECT: one effect that the diagnosis does not have in its catalogue.
"""

ABSORBED = "absorbed"
"""Kind of a trial whose causes recalibration absorbs, so that `no_gap` is the correct verdict."""

PARAMETER = "parameter:"
"""Prefix of a cause that is a parameter off its value; the symbol follows."""

KIND_COUNTS = {NOMINAL: 10, ONE_CAUSE: 25, TWO_EFFECTS: 6, EXCLUDED_EFFECT: 9}
"""Trials of each kind among every fifty [-]."""

CALIBRATED_SPREAD = 0.06
"""Half width of the four calibrated parameters about Table 12 [-], relative, uniform."""

UNIT_SCATTER = 2e-3
"""Relative standard deviation of every other parameter from unit to unit [-]."""

UNIT_SCATTER_LIMIT = 2.0
"""Largest deviation of such a parameter [standard deviations]: units are inspected when built."""

FORM_DEVIATIONS = {"usual": (0.03, 0.15), "strong": (0.20, 0.50)}
"""Least and largest deviation of an effect's form from the fitted form, relative to the effect [-], by
name of the study (forms.py)."""

OTHER_FORM_SHARE = 0.5
"""Probability that an effect has its other form, where it has one (forms.py) [-]: as often as not,
since nobody knows which curve a real valve follows."""

TOP_EFFECTS = ("armature_bounce", "supply_restriction", "magnetic_saturation")
"""Effects that are also drawn at the top of their range. Log-uniform draws seldom come near it, and
there these three were missed on campaigns of another simulator."""

TOP_SHARE = 0.3
"""Probability that such an effect is drawn at its top [-]: about two trials each of 300."""

EFFECTS = tuple(CATALOGUE)

Card = TypeVar("Card")


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One trial's truth."""

    number: int
    """Of the trial, from 0."""
    kind: str
    """As drawn."""
    causes: tuple[str, ...]
    """Names as in gap.json: effects of the catalogue, or `parameter:<symbol>`."""
    sizes: dict[str, float]
    """Sizes of the effects, and values of the parameters that are off, by symbol [SI]."""
    unit: Parameters
    """The valve as built, without the causes."""
    form_deviation: float
    """Deviation of the effects' forms from the fitted ones [-]; 0 without effects."""
    winding_temperature_rise: float = 0.0
    """Rise of the winding's temperature over the session, where the winding heats [K]."""
    other_forms: tuple[str, ...] = ()
    """Effects that have their other form (forms.py)."""

    @property
    def parameters(self) -> Parameters:
        """The valve with the causes."""
        return self.unit.replace(**self.sizes)

    def with_only(self, effect: str) -> "Trial":
        """The same valve with one of its two effects."""
        sizes = {symbol: self.sizes[symbol] for symbol in CATALOGUE[effect] if symbol in self.sizes}
        return replace(
            self,
            kind=ONE_CAUSE,
            causes=(effect,),
            sizes=sizes,
            winding_temperature_rise=self.winding_temperature_rise if "h_coil" in sizes else 0.0,
            other_forms=tuple(name for name in self.other_forms if name == effect),
        )


def trial_plan(seed: int, trials: int) -> list[tuple[str, tuple[str, ...]]]:
    """Kind and causes of the first trials of a seed; a longer plan begins with the same trials.

    Each deck is dealt out before it is shuffled anew, so every effect comes up equally often.
    """
    kind_deck = [kind for kind, count in KIND_COUNTS.items() for _ in range(count)]
    parameters = tuple(PARAMETER + symbol for symbol in PARAMETER_COMPONENTS)
    decks = (kind_deck, EFFECTS * 3 + parameters, EFFECTS, EFFECTS)
    kinds, single, excluded, pair = (
        _dealt(deck, np.random.default_rng([seed, index, 1])) for index, deck in enumerate(decks)
    )
    plan: list[tuple[str, tuple[str, ...]]] = []
    for kind in islice(kinds, trials):
        if kind == TWO_EFFECTS:
            first = next(pair)
            plan.append((kind, (first, next(effect for effect in pair if effect != first))))
        elif kind == NOMINAL:
            plan.append((kind, ()))
        else:
            plan.append((kind, (next(single if kind == ONE_CAUSE else excluded),)))
    return plan


def draw_trial(
    seed: int, number: int, kind: str, causes: Sequence[str], forms: str = "usual", attempt: int = 0
) -> Trial:
    """The truth of one trial of a plan.

    seed: of the study. causes: their names. forms: of FORM_DEVIATIONS. attempt: draws other sizes and
    another unit, for a trial whose valve no solver could follow.
    """
    rng = np.random.default_rng([seed, number, *([attempt] if attempt else [])])
    unit = draw_unit(rng)
    sizes: dict[str, float] = {}
    for cause in causes:
        symbol = cause.removeprefix(PARAMETER)
        if symbol == cause:
            variants = effect(cause).drawn
            chosen = variants[int(rng.integers(len(variants)))]
            sizes |= {size.symbol: size.draw(rng, size.drawn or (0.0, 0.0)) for size in chosen}
        else:
            share = rng.uniform(0.015, 0.05)
            off = 1.0 + (-share if rng.uniform() < 0.5 else share)
            sizes[symbol] = Parameters.calibrated()[symbol] * off
    deviation = rng.uniform(*FORM_DEVIATIONS[forms])
    temperature_rise = np.exp(rng.uniform(*np.log((1.0, 20.0))))  # K, over a session
    # Drawn last: the draws above stay those of a study without other forms.
    other_forms = _some(causes, OTHER_FORMS, OTHER_FORM_SHARE, rng)
    for name in _some(causes, TOP_EFFECTS, TOP_SHARE, rng):
        sizes |= top_sizes(name)
    return Trial(
        number=number,
        kind=kind,
        causes=tuple(causes),
        sizes=sizes,
        unit=unit,
        form_deviation=float(deviation) if set(causes) & set(CATALOGUE) else 0.0,
        winding_temperature_rise=float(temperature_rise) if "h_coil" in sizes else 0.0,
        other_forms=other_forms,
    )


def draw_unit(rng: np.random.Generator) -> Parameters:
    """A valve as built: the four calibrated parameters and all others scatter."""
    centre, limit = Parameters.calibrated(), UNIT_SCATTER_LIMIT
    four = 1.0 + rng.uniform(-CALIBRATED_SPREAD, CALIBRATED_SPREAD, len(CALIBRATED_SYMBOLS))
    others = truncnorm.rvs(-limit, limit, size=len(PARAMETER_COMPONENTS), random_state=rng)
    factors = dict(zip(CALIBRATED_SYMBOLS, four, strict=True))
    scattered = 1.0 + UNIT_SCATTER * np.asarray(others)
    factors |= dict(zip(PARAMETER_COMPONENTS, scattered, strict=True))
    return centre.replace(**{s: float(centre[s] * factor) for s, factor in factors.items()})


def top_sizes(name: str) -> dict[str, float]:
    """Sizes of an effect at the top of what is drawn, by symbol [SI]."""
    return {size.symbol: (size.drawn or (0.0, 0.0))[1] for size in effect(name).drawn[0]}


def _some(
    causes: Sequence[str], among: Collection[str], share: float, rng: np.random.Generator
) -> tuple[str, ...]:
    """Those of the causes that are among others, each with this probability [-]."""
    return tuple(cause for cause in causes if cause in among and rng.uniform() < share)


def _dealt(deck: Sequence[Card], rng: np.random.Generator) -> Iterator[Card]:
    """Cards without end: the deck shuffled, dealt out, shuffled again."""
    while True:
        yield from (deck[index] for index in rng.permutation(len(deck)))
