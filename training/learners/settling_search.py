"""The search that settles a supervisor: its range, and the settings tried so far.

COBYLA (Powell, in: Advances in Optimization and Numerical Analysis, Kluwer 1994) follows linear models
of the ratios that training/learners/supervision.py measures.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import NonlinearConstraint, minimize

from controllers.supervisor_settings import SETTINGS, SupervisorSettings
from training.learners.validation import ValidationSettings

SETTLED = ("height", "free_below", "reluctance", "ceiling")
"""The settings that are searched."""


@dataclass(frozen=True, kw_only=True)
class SettlingSearch:
    """A search of height, of the forecast that sets a pulse free, of reluctance, and of the ceiling."""

    start: tuple[float, float, float, float] = (0.01, -0.09, 2.6, 0.16)
    """First height [bar], `free_below` [bar], decimal logarithm of the reluctance [1/bar], and ceiling
    [bar]."""
    step: tuple[float, float, float, float] = (0.02, 0.03, 0.4, 0.03)
    """First change of each."""
    least: tuple[float, float, float, float] = (-0.1, -0.5, -1.0, 0.05)
    """Of each."""
    greatest: tuple[float, float, float, float] = (0.1, 0.3, 5.0, 0.4)
    """Of each."""
    ratio_step: float = 0.05
    """First change of the largest ratio [1]."""
    evaluations: int = 16
    """Most evaluations of a round, 6 at least."""
    rounds: int = 2
    """Most rounds."""
    again_above: float = 1.05
    """Largest ratio above which another round begins, at the best settings so far."""
    near_miss_share: float = 0.3
    """`SupervisorSettings.near_miss_share`, which is not searched [1]."""
    worst_bar: float = 0.46
    """Mean excursion of the worst hundredth of the episodes that is as bad as a ratio of 1 [bar]."""
    validation: ValidationSettings = field(
        default_factory=lambda: ValidationSettings(episodes=1024, duration=10.0)
    )
    """Episodes of an evaluation."""
    rival: ValidationSettings = field(
        default_factory=lambda: ValidationSettings(episodes=4096, duration=10.0)
    )
    """Episodes of the adaptive pulse: those of an evaluation and more."""


SETTLING = SettlingSearch()
QUICK_SETTLING = SettlingSearch(
    evaluations=6, validation=ValidationSettings(episodes=8, duration=1.0),
    rival=ValidationSettings(episodes=8, duration=1.0),
)  # fmt: skip
"""For --quick: too few episodes to find the best."""


class Trials:
    """Settings tried so far, as places in units of the search's first changes from its start.

    The last entry of a place is the variable that no ratio may exceed, (it - 1) / `ratio_step`.
    """

    def __init__(self, ratios: Callable[[SupervisorSettings], list[float]], search: SettlingSearch):
        """
        Args:
            ratios: of given settings; measured once for each.
            search: what defines the search.
        """
        self._measure, self._search = ratios, search
        self._start, self._step = np.array(search.start), np.array(search.step)
        self._ratios: dict[SupervisorSettings, list[float]] = {}
        self._places: dict[SupervisorSettings, NDArray] = {}
        self._excess(np.zeros(len(SETTLED) + 1))

    @property
    def best(self) -> SupervisorSettings:
        """Those with the smallest largest ratio."""
        return min(self._ratios, key=self.largest)

    def largest(self, settings: SupervisorSettings) -> float:
        """Largest ratio of settings that were tried."""
        return max(self._ratios[settings])

    def run_round(self) -> None:
        """A round of the search, from the best settings so far."""
        search, first = self._search, self._places[self.best].copy()
        first[-1] = (self.largest(self.best) - 1) / search.ratio_step
        ends = ((np.array(end) - self._start) / self._step for end in (search.least, search.greatest))
        bounds: Any = [*zip(*ends, strict=True), (None, None)]
        minimize(
            lambda place: place[-1], first, method="COBYLA", bounds=bounds,
            constraints=NonlinearConstraint(self._excess, -np.inf, 0.0),
            options={"maxiter": search.evaluations + 1, "tol": 0.05},
        )  # fmt: skip

    def _excess(self, place: NDArray) -> NDArray:
        """By how much each ratio exceeds the variable that bounds them (4,)."""
        search = self._search
        at = np.clip(self._start + self._step * place[:-1], search.least, search.greatest)
        settings = _settings(at, search.near_miss_share)
        if settings not in self._ratios:
            self._ratios[settings] = self._measure(settings)
            self._places[settings] = place.copy()
        return np.array(self._ratios[settings]) - 1 - search.ratio_step * place[-1]


def at_bounds(settings: SupervisorSettings, search: SettlingSearch) -> list[str]:
    """Names of the settings that ended within a thousandth of their range from one of its ends."""
    at = np.array([getattr(settings, name) for name in SETTLED])
    at[2] = np.log10(settings.reluctance)
    near = 1e-3 * np.subtract(search.greatest, search.least)
    beyond = (at < search.least + near) | (at > search.greatest - near)
    return [name for name, ended in zip(SETTLED, beyond, strict=True) if ended]


def _settings(at: NDArray, near_miss_share: float) -> SupervisorSettings:
    height, free_below, magnitude, ceiling = map(float, at)
    return replace(
        SETTINGS, height=round(height, 4), free_below=round(free_below, 4),
        reluctance=round(10**magnitude, 1), ceiling=round(ceiling, 4), near_miss_share=near_miss_share,
    )  # fmt: skip
