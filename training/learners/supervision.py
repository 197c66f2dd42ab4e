"""What training settles last: how high a policy's supervisor holds p2, and which pulses it holds back.

A higher p2 means a smaller breakdown and a larger rms error, fewer pulses mean fewer switchings and a
larger breakdown. The adaptive pulse, the best of the classic controllers, shows on the same validation
episodes what is usual of all three. The largest of the three ratios to its figures is minimised (an
achievement scalarising function: Miettinen, Nonlinear Multiobjective Optimization, Kluwer 1999).
"""

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
from controllers.supervisor import SETTINGS, SupervisorSettings
from controllers.tuned import build, load_tunings
from epv_env.plant.consumption import MIXED
from epv_env.plant.plantfile import Plant
from training.evaluation.metrics import summary
from training.evaluation.scenarios import TUNING_REGION
from training.learners.validation import ValidationSettings, validate


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
    evaluations: int = 30
    """Most evaluations."""
    validation: ValidationSettings = field(
        default_factory=lambda: ValidationSettings(episodes=768, duration=6.0)
    )
    """Episodes of an evaluation."""


SETTLING = SettlingSearch()
QUICK_SETTLING = SettlingSearch(evaluations=4, validation=ValidationSettings(episodes=8, duration=1.0))
"""For --quick: too few episodes to find the best."""


def settle(
    policy: LearnedPolicy,
    plant: Plant,
    options: dict[str, Any],
    search: SettlingSearch = SETTLING,
    *,
    quiet: bool = False,
) -> SupervisorFile:
    """The settings of the policy's supervisor.

    Args:
        policy: for the on/off environment.
        plant: nominal plant.
        options: of the validation episodes, without the plant.
        search: what defines the search.
        quiet: no progress bar.
    """
    episodes = {"plant": plant, **options}
    rival = build(REGISTRATION.kind, load_tunings()[REGISTRATION.kind].values, plant)
    usual = _figures(rival, search.validation, episodes)

    def worst_ratio(at: NDArray) -> float:
        own = supervised(policy, plant, _settings(at))
        bar.update()
        return max(_ratios(_figures(own, search.validation, episodes), usual))

    with tqdm(total=search.evaluations, desc="supervisor", unit="trial", disable=quiet) as bar:
        found: Any = minimize(
            worst_ratio, search.simplex[0], method="Nelder-Mead",
            bounds=tuple(zip(search.least, search.greatest, strict=True)),
            options={"initial_simplex": search.simplex, "maxfev": search.evaluations},
        )  # fmt: skip
    how = {**asdict(search), "largest_ratio": float(found.fun)}
    return SupervisorFile(settings=_settings(found.x), search=how)


def _settings(at: NDArray) -> SupervisorSettings:
    height, free_below, magnitude = map(float, at)
    return replace(
        SETTINGS, height=round(height, 4), free_below=round(free_below, 4),
        reluctance=round(10**magnitude, 1),
    )  # fmt: skip


def _figures(
    controller: Controller, validation: ValidationSettings, options: dict[str, Any]
) -> list[float]:
    """What the settings trade against each other: rms error, breakdown of an event, switchings.

    The rms error is a mean over the episodes: that of all together would hide most behind the few worst.
    """
    metrics = validate(controller, validation, options)
    found = summary(metrics)
    breakdown, switchings = found["C2_event_breakdown_bar"], found["switchings_per_s"]
    return [float(np.mean(metrics.rms_bar)), breakdown, switchings]


def _ratios(own: Sequence[float], usual: Sequence[float]) -> list[float]:
    """Each figure over the rival's; one that the rival has none of, as without consumption, is equal."""
    return [mine / its if its > 0 else 1.0 for mine, its in zip(own, usual, strict=True)]


def settle_missing(folders: Sequence[Path], *, workers: int, search: SettlingSearch = SETTLING) -> None:
    """Settle the supervisors of policies that have none, for the report's plant within ±10 %."""
    missing = [folder for folder in folders if load_settings(folder) is None]
    pool: Any = Parallel(n_jobs=workers, return_as="generator_unordered")
    jobs = (delayed(_settle_into)(folder, search) for folder in missing)
    for _ in tqdm(pool(jobs), total=len(missing), desc="supervisors", disable=not missing):
        pass


def _settle_into(folder: Path, search: SettlingSearch) -> None:
    options = {"scenario": MIXED, "parameters": TUNING_REGION, "threads": 1}
    found = settle(load_policy(folder), Plant.calibrated(), options, search, quiet=True)
    save_settings(found, folder)
