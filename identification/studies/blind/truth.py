"""The truth of a trial: the valve as built, the causes of its gap, and how their forms deviate."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TypeVar

import numpy as np
from scipy.stats import truncnorm

from epv_env.plant.effects.registry import CATALOGUE
from epv_env.plant.parameters import Parameters
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.studies.blind.effect_draws import (
    WARMEST,
    draw_parameter,
    draw_sizes,
    top_sizes,
)
from identification.studies.blind.kinds import (
    EXCLUDED_EFFECT,
    NOMINAL,
    ONE_CAUSE,
    PARAMETER,
    TWO_EFFECTS,
)
from identification.studies.blind.other_forms import OTHER_FORMS
from identification.studies.blind.settings import DEFAULTS, BlindSettings
from identification.valve_gap.causes import PARAMETER_COMPONENTS

EFFECTS = tuple(CATALOGUE)

Card = TypeVar("Card")


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One trial's truth."""

    number: int
    """Of the trial, from 0."""
    kind: str
    """As drawn (kinds.py)."""
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
    """Effects that have their other form (other_forms.py)."""

    @property
    def parameters(self) -> Parameters:
        """The valve with the causes."""
        return self.unit.replace(**self.sizes)

    @property
    def excluded(self) -> tuple[str, ...]:
        """Causes that the diagnosis must do without."""
        return self.causes if self.kind == EXCLUDED_EFFECT else ()

    def with_only(self, effect: str) -> "Trial":
        """The same valve with one of its two effects."""
        sizes = {symbol: self.sizes[symbol] for symbol in CATALOGUE[effect] if symbol in self.sizes}
        return Trial(
            number=self.number,
            kind=ONE_CAUSE,
            causes=(effect,),
            sizes=sizes,
            unit=self.unit,
            form_deviation=self.form_deviation,
            winding_temperature_rise=self.winding_temperature_rise if "h_coil" in sizes else 0.0,
            other_forms=tuple(name for name in self.other_forms if name == effect),
        )


def trial_plan(
    seed: int, trials: int, settings: BlindSettings = DEFAULTS
) -> list[tuple[str, tuple[str, ...]]]:
    """Kind and causes of the first trials of a seed; a longer plan begins with the same trials.

    Each deck is dealt out before it is shuffled anew, so every effect comes up equally often.
    """
    kind_deck = [kind for kind, count in settings.kind_counts for _ in range(count)]
    parameters = tuple(PARAMETER + symbol for symbol in PARAMETER_COMPONENTS)
    decks = (kind_deck, EFFECTS * settings.effect_copies + parameters, EFFECTS, EFFECTS)
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
    seed: int,
    number: int,
    kind: str,
    causes: Sequence[str],
    attempt: int = 0,
    settings: BlindSettings = DEFAULTS,
) -> Trial:
    """The truth of one trial of a plan.

    attempt: draws other sizes and another unit, for a trial whose valve no solver could follow.
    """
    rng = np.random.default_rng([seed, number, *([attempt] if attempt else [])])
    unit = draw_unit(rng, settings)
    sizes: dict[str, float] = {}
    for cause in causes:
        symbol = cause.removeprefix(PARAMETER)
        if symbol == cause:
            sizes |= draw_sizes(cause, rng)
        else:
            sizes[symbol] = draw_parameter(Parameters.calibrated()[symbol], rng)
    deviation = rng.uniform(*settings.form_deviation)
    temperature_rise = np.exp(rng.uniform(*np.log(WARMEST)))
    # Drawn last: the draws above stay those of a study without other forms.
    other_forms = _some(causes, OTHER_FORMS, settings.other_form_share, rng)
    for name in _some(causes, settings.top_effects, settings.top_share, rng):
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


def draw_unit(rng: np.random.Generator, settings: BlindSettings = DEFAULTS) -> Parameters:
    """A valve as built: the four calibrated parameters and all others scatter."""
    centre, spread, limit = (
        Parameters.calibrated(),
        settings.calibrated_spread,
        settings.unit_scatter_limit,
    )
    four = 1.0 + rng.uniform(-spread, spread, len(CALIBRATED_SYMBOLS))
    others = truncnorm.rvs(-limit, limit, size=len(PARAMETER_COMPONENTS), random_state=rng)
    factors = dict(zip(CALIBRATED_SYMBOLS, four, strict=True))
    scattered = 1.0 + settings.unit_scatter * np.asarray(others)
    factors |= dict(zip(PARAMETER_COMPONENTS, scattered, strict=True))
    return centre.replace(**{s: float(centre[s] * factor) for s, factor in factors.items()})


def _some(
    causes: Sequence[str], among: Collection[str], share: float, rng: np.random.Generator
) -> tuple[str, ...]:
    """Those of the causes that are among others, each with this probability [-]."""
    return tuple(cause for cause in causes if cause in among and rng.uniform() < share)


def _dealt(deck: Sequence[Card], rng: np.random.Generator) -> Iterator[Card]:
    """Cards without end: the deck shuffled, dealt out, shuffled again."""
    while True:
        yield from (deck[index] for index in rng.permutation(len(deck)))
