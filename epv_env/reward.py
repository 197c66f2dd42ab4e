"""The reward: the ±500 mbar band of control aim C1, the pressure dip of C2, and what control costs."""

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from epv_env.signals import as_number

BAND_BAR = 0.5
"""Tolerance of control aim C1 (section 2.3)."""

EMPTY_CIRCUIT_BAR = 1.5
"""Circuit pressure at which an episode fails: the consumers could no longer draw their flow."""

WIDEST_BAND_BAR = 16.0
"""The sensors' range: no pressure is farther from a target."""

LARGEST = 1e9
"""More than any weight or parameter is."""

REFERENCE_PERIOD = 5e-3
"""Control period to which the weights refer [s]; other periods scale the running terms."""


@dataclass(frozen=True, kw_only=True)
class RewardWeights:
    """Price of each term, and the band; every term is zero at best. Running terms are per 5 ms."""

    band: float = 2.0
    """Outside target ±`band_bar` at any instant of the period (C1)."""
    band_bar: float = BAND_BAR
    """Half-width of the band that is priced, C1's own unless a training wants a margin [bar]."""
    tracking: float = 0.25
    """|p2 - target| at the end of the period, in units of 500 mbar."""
    breakdown: float = 0.25
    """Largest shortfall of p2 below the target in the period, in units of 500 mbar (C2)."""
    switching: float = 0.3
    """Each switching of the coil (wear)."""
    vented_air: float = 2.0
    """Each gram of air blown off by the magnet valve."""
    failure: float = 100.0
    """An empty circuit, which ends the episode."""

    def __post_init__(self) -> None:
        for entry in fields(self):
            as_number(f"weights: {entry.name}", getattr(self, entry.name), (0.0, LARGEST))
        if not 0 < self.band_bar <= WIDEST_BAND_BAR:
            raise ValueError(
                f"band_bar = {self.band_bar!r} must lie above 0 and at most at {WIDEST_BAND_BAR:g} bar"
            )


class RewardTerms(NamedTuple):
    """What each weight contributed, already weighted and negative; arrays of shape (n,)."""

    band: NDArray
    """Deviation outside the band."""
    tracking: NDArray
    """Distance from the target at the end of the period."""
    breakdown: NDArray
    """Shortfall below the target."""
    switching: NDArray
    """Switchings of the coil."""
    vented_air: NDArray
    """Air blown off."""
    failure: NDArray
    """End of the episode by an empty circuit."""


def total(terms):
    """Sum of RewardTerms, the reward, of any shape [-]. The step compiles this function."""
    return (
        terms.band + terms.tracking + terms.breakdown + terms.switching + terms.vented_air
        + terms.failure
    )  # fmt: skip


def reward_terms(
    weights, period, error_bar, highest_error_bar, lowest_error_bar, switchings, vented_kg, failed
):
    """RewardTerms of one control period, of numbers or arrays (n,). The step compiles this function.

    weights: RewardWeights, or a record with its fields. period: control period [s]. error_bar: p2 -
    target at the end of the period [bar], and its greatest and least value within it. switchings: of
    the coil. vented_kg: air blown off [kg]. failed: whether the circuit is empty.
    """
    scale = period / REFERENCE_PERIOD
    outside = np.maximum(highest_error_bar, -lowest_error_bar) > weights.band_bar
    shortfall = np.maximum(-lowest_error_bar, 0.0)
    return RewardTerms(
        band=-weights.band * scale * outside,
        tracking=-weights.tracking * scale / BAND_BAR * abs(error_bar),
        breakdown=-weights.breakdown * scale / BAND_BAR * shortfall,
        switching=-weights.switching * switchings,
        vented_air=-weights.vented_air * 1e3 * vented_kg,
        failure=-weights.failure * failed,
    )
