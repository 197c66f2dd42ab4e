"""What training settles last: how high a policy's supervisor holds p2, and which pulses it holds back.

A higher p2 means a smaller breakdown and a larger rms error, fewer pulses mean fewer switchings and a
larger breakdown. The adaptive pulse, the best of the classic controllers, shows on validation episodes
what is usual of all three. Each figure's ratio to the rival's has a 95 % interval, wider for switchings
than for breakdown; the largest of the three upper ends is minimised (an achievement scalarising
function: Miettinen, Nonlinear Multiobjective Optimization, Kluwer 1999).
"""

import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from scipy.optimize import minimize
from tqdm import tqdm

from controllers.adaptive_pulse import REGISTRATION
from controllers.base import Controller
from controllers.learned import LearnedPolicy, load_policy
from controllers.supervised import SupervisorFile, load_settings, save_settings, supervised
from controllers.supervisor_settings import SETTINGS, SupervisorSettings
from controllers.tuned import build, load_tunings
from epv_env.plant.consumption import MIXED
from epv_env.plant.plantfile import Plant
from training.evaluation.scenarios import TUNING_REGION
from training.learners.validation import ValidationSettings, validate

SETTLED = ("height", "free_below", "reluctance")
"""The settings that are searched."""


@dataclass(frozen=True, kw_only=True)
class SettlingSearch:
    """A Nelder-Mead search of height, of the forecast that sets a pulse free, and of reluctance."""

    simplex: tuple[tuple[float, float, float], ...] = (
        (-0.01, -0.05, 2.6), (0.015, -0.07, 2.6), (-0.03, -0.03, 2.7), (-0.01, -0.07, 2.2),
    )  # fmt: skip
    """First heights [bar], `free_below` [bar], and decimal logarithms of the reluctance [1/bar]."""
    least: tuple[float, float, float] = (-0.1, -0.3, -1.0)
    """Of each."""
    greatest: tuple[float, float, float] = (0.1, 0.3, 4.0)
    """Of each."""
    evaluations: int = 24
    """Most evaluations."""
    validation: ValidationSettings = field(
        default_factory=lambda: ValidationSettings(episodes=1024, duration=10.0)
    )
    """Episodes of an evaluation."""
    rival: ValidationSettings = field(
        default_factory=lambda: ValidationSettings(episodes=4096, duration=10.0)
    )
    """Episodes of the adaptive pulse, whose switchings differ most between episodes."""


SETTLING = SettlingSearch()
QUICK_SETTLING = SettlingSearch(
    evaluations=4, validation=ValidationSettings(episodes=8, duration=1.0),
    rival=ValidationSettings(episodes=8, duration=1.0),
)  # fmt: skip
"""For --quick: too few episodes to find the best."""

EPISODES: dict[str, Any] = {"scenario": MIXED, "parameters": TUNING_REGION, "threads": 1}
"""Options of the episodes for the kept policies."""


@dataclass(frozen=True, kw_only=True)
class Figures:
    """What the settings trade against each other: rms error [bar], breakdown of an event [bar] and
    switchings [1/s]. Means over episodes: the few worst would hide the others in a common rms error."""

    mean: NDArray
    """(3,)."""
    error: NDArray
    """Their standard errors (3,)."""


def settle(
    policy: LearnedPolicy,
    plant: Plant,
    options: dict[str, Any],
    search: SettlingSearch = SETTLING,
    *,
    usual: Figures | None = None,
    quiet: bool = False,
) -> SupervisorFile:
    """The settings of the policy's supervisor.

    Args:
        policy: for the on/off environment.
        plant: nominal plant.
        options: of the validation episodes, without the plant.
        search: what defines the search.
        usual: `usual_figures` of these arguments; None: they are measured first.
        quiet: no progress bar.
    """
    episodes = {"plant": plant, **options}

    def worst_ratio(at: NDArray) -> float:
        own = _figures(supervised(policy, plant, _settings(at)), search.validation, episodes)
        bar.update()
        return max(_upper_ratios(own, rival))

    with tqdm(total=search.evaluations, desc="supervisor", unit="trial", disable=quiet) as bar:
        rival = usual or usual_figures(plant, options, search)
        found: Any = minimize(
            worst_ratio, search.simplex[0], method="Nelder-Mead",
            bounds=tuple(zip(search.least, search.greatest, strict=True)),
            options={"initial_simplex": search.simplex, "maxfev": search.evaluations},
        )  # fmt: skip
    ended = _at_bounds(found.x, search)
    if ended:
        tqdm.write(
            f"supervisor of {policy.name!r}: the search of {', '.join(ended)} ended at a bound, so "
            "better settings may lie beyond: widen SettlingSearch (training/learners/supervision.py)",
            file=sys.stderr,
        )
    how = {**asdict(search), "largest_ratio": float(found.fun), "at_bound": ended}
    return SupervisorFile(settings=_settings(found.x), search=how)


def _at_bounds(at: NDArray, search: SettlingSearch) -> list[str]:
    """Names of the settings that ended within a thousandth of their range from one of its ends."""
    near = 1e-3 * np.subtract(search.greatest, search.least)
    beyond = (at < search.least + near) | (at > search.greatest - near)
    return [name for name, ended in zip(SETTLED, beyond, strict=True) if ended]


def usual_figures(plant: Plant, options: dict[str, Any], search: SettlingSearch = SETTLING) -> Figures:
    """The figures of the tuned adaptive pulse; arguments as those of `settle`."""
    rival = build(REGISTRATION.kind, load_tunings()[REGISTRATION.kind].values, plant)
    return _figures(rival, search.rival, {"plant": plant, **options})


def _settings(at: NDArray) -> SupervisorSettings:
    height, free_below, magnitude = map(float, at)
    return replace(
        SETTINGS, height=round(height, 4), free_below=round(free_below, 4),
        reluctance=round(10**magnitude, 1),
    )  # fmt: skip


def _figures(controller: Controller, validation: ValidationSettings, options: dict[str, Any]) -> Figures:
    """A controller's figures on the validation episodes."""
    metrics = validate(controller, validation, options)
    each = np.stack([metrics.rms_bar, metrics.event_breakdown_bar, metrics.switchings_per_s])
    return Figures(mean=each.mean(axis=1), error=each.std(axis=1) / np.sqrt(len(metrics)))


def _upper_ratios(own: Figures, usual: Figures) -> list[float]:
    """Upper 95 % ends of each figure over the rival's, of a normal distribution; one that the rival has
    none of, as without consumption, is equal."""
    ratios = []
    for mine, my_error, its, its_error in zip(own.mean, own.error, usual.mean, usual.error, strict=True):
        if its > 0:
            ratio = mine / its
            ratios.append(float(ratio + 1.96 * np.hypot(my_error, ratio * its_error) / its))
        else:
            ratios.append(1.0)
    return ratios


def settle_missing(folders: Sequence[Path], *, workers: int, search: SettlingSearch = SETTLING) -> None:
    """Settle the supervisors of policies that have none, for the report's plant within ±10 %."""
    missing = [folder for folder in folders if load_settings(folder) is None]
    if not missing:
        return
    usual = usual_figures(Plant.calibrated(), EPISODES, search)
    pool: Any = Parallel(n_jobs=workers, return_as="generator_unordered")
    jobs = (delayed(_settle_into)(folder, search, usual) for folder in missing)
    for _ in tqdm(pool(jobs), total=len(missing), desc="supervisors"):
        pass


def _settle_into(folder: Path, search: SettlingSearch, usual: Figures) -> None:
    plant, policy = Plant.calibrated(), load_policy(folder)
    save_settings(settle(policy, plant, EPISODES, search, usual=usual, quiet=True), folder)
