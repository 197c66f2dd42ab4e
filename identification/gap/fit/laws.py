"""Laws: the strength of a cause as a function of a state, fitted in the simulation.

The catalogue assumes a law for each mechanism, such as friction that does not depend on the pressure.
The strength of the real mechanism may be strength (1 + g(a)) instead, where a is a state of the plant.
g has a Gaussian process prior (Rasmussen and Williams 2006). The principal components of the prior at
nine knots are fitted beside the size of the cause and all other parameters. So the right mechanism over
the right state needs little of the prior, and a wrong one buys its fit with a wild law.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from epv_env.common.law_form import KNOTS
from identification.gap.plant import Cause, FreeParameter

SD, LENGTH = 0.5, 0.35
"""Standard deviation of g [1], as laws of one mechanism differ by half, and the length over which it
changes, relative to the range of the state [1]: a line or a parabola, but no ripple."""

MOST_OF_CAUSE = 2
"""Most laws of one cause that are open at once: a mechanism follows one or two states."""

KEPT_VARIANCE = 0.97
"""Share of the prior's variance that the components hold [1]."""

LARGEST = 3.0
"""Bound of a component [standard deviations]."""


def _components() -> NDArray:
    """Principal components of the prior at the knots, each times its standard deviation (knots, m).

    g has no mean over the knots: the size of the cause carries it.
    """
    apart = np.subtract.outer(np.arange(KNOTS), np.arange(KNOTS)) / ((KNOTS - 1) * LENGTH)
    centred = np.eye(KNOTS) - 1.0 / KNOTS
    variances, vectors = np.linalg.eigh(centred @ (SD**2 * np.exp(-0.5 * apart**2)) @ centred)
    order = np.argsort(-variances)
    held = np.cumsum(variances[order]) / np.sum(variances)
    kept = order[: int(np.argmax(held >= KEPT_VARIANCE)) + 1]
    return vectors[:, kept] * np.sqrt(variances[kept])


COMPONENTS = _components()
"""g at the knots by components, (knots, m) [1/standard deviation]."""


@dataclass(frozen=True, kw_only=True)
class Law:
    """A law of a cause over one state, whose shape is open."""

    cause: Cause
    argument: str
    """Name of the state."""
    low: float
    """Least state reached, at the first knot [SI]."""
    high: float
    """Greatest state reached, at the last knot [SI]."""

    @cached_property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """Its components, each with the prior N(0, 1)."""
        return tuple(
            FreeParameter(
                symbol=f"law of {self.cause.label} over {self.argument}, {k}",
                unit="1",
                low=-LARGEST,
                high=LARGEST,
                scale=1.0,
                sd=1.0,
            )
            for k in range(1, COMPONENTS.shape[1] + 1)
        )

    @property
    def knots(self) -> NDArray:
        """The state at the knots, (knots,) [SI]."""
        return np.linspace(self.low, self.high, KNOTS)

    def growth(self, components: NDArray) -> NDArray:
        """g at the knots, (knots,) [1]; components: (m,) [standard deviations]."""
        return COMPONENTS @ components


AS_ASSUMED = "as assumed"
"""What is said of causes none of whose laws is open (contract: gap.json)."""


def in_words(laws: Sequence[tuple[Law, NDArray]]) -> str:
    """How the strengths of causes follow states; laws: each with its components (m,)."""
    texts = []
    for law, components in laws:
        growth = np.maximum(law.growth(components), -1.0)  # no strength is negative
        texts.append(
            f"the strength of {law.cause.label} follows {law.argument}: {growth[0]:+.0%} at its least "
            f"value, {growth[KNOTS // 2]:+.0%} in the middle, {growth[-1]:+.0%} at its greatest"
        )
    return "; ".join(texts) or AS_ASSUMED
