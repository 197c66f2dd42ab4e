"""How large a drawn effect is: a physically sensible part of its range (docs/explanation/effects.md).

From about a tenth of the top to the top, log-uniform: small ones show where detection ends.
"""

import numpy as np

from epv_env.plant.effects.registry import effect

PARAMETER_OFF = (0.015, 0.05)
"""How far a parameter is off that is the cause, as a share of its table value; either sign."""

WARMEST = (1.0, 20.0)
"""How warm a winding that heats becomes over a session [K], log-uniform."""


def draw_sizes(name: str, rng: np.random.Generator) -> dict[str, float]:
    """Sizes of one variant of an effect of the catalogue by symbol [SI]. Raises EffectError."""
    alternatives = effect(name).drawn
    chosen = alternatives[int(rng.integers(len(alternatives)))]
    return {size.symbol: size.draw(rng, size.drawn or (0.0, 0.0)) for size in chosen}


def top_sizes(name: str) -> dict[str, float]:
    """Sizes of an effect at the top of what is drawn, by symbol [SI]. Raises EffectError."""
    return {size.symbol: (size.drawn or (0.0, 0.0))[1] for size in effect(name).drawn[0]}


def draw_parameter(value: float, rng: np.random.Generator) -> float:
    """A value that is off the table's."""
    share = rng.uniform(*PARAMETER_OFF)
    return value * (1.0 + (-share if rng.uniform() < 0.5 else share))
