"""What training settles last: how high a policy's supervisor holds p2, and which pulses it holds back.

A higher p2 means a smaller breakdown and a larger rms error, fewer pulses mean fewer switchings and a
larger breakdown. The adaptive pulse, the best of the classic controllers, shows on validation episodes
what is usual of all three. Each figure's ratio to the rival's has a 95 % interval. The three upper ends
alone would let the policy come closer to the band's ends, so a fourth ratio bounds the excursion of the
worst episodes. The largest of the four is minimised (an achievement scalarising function: Miettinen,
Nonlinear Multiobjective Optimization, Kluwer 1999), as a variable that none of them may exceed: each
ratio is smooth in the settings, their largest is not.
"""

import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from scipy.optimize import NonlinearConstraint, minimize
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

FIGURES = ("rms_bar", "event_breakdown_bar", "switchings_per_s", "excursion_bar")
"""What the settings trade against each other, as `EpisodeMetrics` calls it."""


@dataclass(frozen=True, kw_only=True)
class SettlingSearch:
    """A search of height, of the forecast that sets a pulse free, and of reluctance.

    COBYLA (Powell, in: Advances in Optimization and Numerical Analysis, Kluwer 1994) follows linear
    models of the ratios.
    """

    start: tuple[float, float, float] = (0.02, -0.07, 2.6)
    """First height [bar], `free_below` [bar], and decimal logarithm of the reluctance [1/bar]."""
    step: tuple[float, float, float] = (0.02, 0.03, 0.4)
    """First change of each."""
    least: tuple[float, float, float] = (-0.1, -0.3, -1.0)
    """Of each."""
    greatest: tuple[float, float, float] = (0.1, 0.3, 5.0)
    """Of each."""
    ratio_step: float = 0.05
    """First change of the largest ratio [1]."""
    evaluations: int = 14
    """Most evaluations, 5 at least."""
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
    evaluations=5, validation=ValidationSettings(episodes=8, duration=1.0),
    rival=ValidationSettings(episodes=8, duration=1.0),
)  # fmt: skip
"""For --quick: too few episodes to find the best."""

EPISODES: dict[str, Any] = {"scenario": MIXED, "parameters": TUNING_REGION, "threads": 1}
"""Options of the episodes for the kept policies."""


def settle(
    policy: LearnedPolicy,
    plant: Plant,
    options: dict[str, Any],
    search: SettlingSearch = SETTLING,
    *,
    usual: NDArray | None = None,
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
    start, step = np.array(search.start), np.array(search.step)
    tried: dict[SupervisorSettings, list[float]] = {}

    def settings_at(place: NDArray) -> SupervisorSettings:
        return _settings(np.clip(start + step * place[:3], search.least, search.greatest))

    def excess(place: NDArray) -> NDArray:
        """By how much each ratio exceeds the variable that bounds them (4,)."""
        settings = settings_at(place)
        if settings not in tried:
            own = _figures(supervised(policy, plant, settings), search.validation, episodes)
            tried[settings] = _ratios(own, rival, search.worst_bar)
            bar.update()
        return np.array(tried[settings]) - 1 - search.ratio_step * place[3]

    with tqdm(total=search.evaluations, desc="supervisor", unit="trial", disable=quiet) as bar:
        rival = usual_figures(plant, options, search) if usual is None else usual
        ends = ((np.array(end) - start) / step for end in (search.least, search.greatest))
        bounds: Any = [*zip(*ends, strict=True), (None, None)]
        first = max(excess(np.zeros(4))) / search.ratio_step
        minimize(
            lambda place: place[3], [0.0, 0.0, 0.0, first], method="COBYLA",
            constraints=NonlinearConstraint(excess, -np.inf, 0.0),
            bounds=bounds, options={"maxiter": search.evaluations + 1, "tol": 0.05},
        )  # fmt: skip
    best = min(tried, key=lambda settings: max(tried[settings]))
    ended = _at_bounds(best, search)
    if ended:
        tqdm.write(
            f"supervisor of {policy.name!r}: the search of {', '.join(ended)} ended at a bound, so "
            "better settings may lie beyond: widen SettlingSearch (training/learners/supervision.py)",
            file=sys.stderr,
        )
    how = {**asdict(search), "largest_ratio": max(tried[best]), "at_bound": ended}
    return SupervisorFile(settings=best, search=how)


def _at_bounds(settings: SupervisorSettings, search: SettlingSearch) -> list[str]:
    """Names of the settings that ended within a thousandth of their range from one of its ends."""
    at = np.array([settings.height, settings.free_below, np.log10(settings.reluctance)])
    near = 1e-3 * np.subtract(search.greatest, search.least)
    beyond = (at < search.least + near) | (at > search.greatest - near)
    return [name for name, ended in zip(SETTLED, beyond, strict=True) if ended]


def usual_figures(plant: Plant, options: dict[str, Any], search: SettlingSearch = SETTLING) -> NDArray:
    """FIGURES of the tuned adaptive pulse in each episode (4, n); arguments as those of `settle`."""
    rival = build(REGISTRATION.kind, load_tunings()[REGISTRATION.kind].values, plant)
    return _figures(rival, search.rival, {"plant": plant, **options})


def _settings(at: NDArray) -> SupervisorSettings:
    height, free_below, magnitude = map(float, at)
    return replace(
        SETTINGS, height=round(height, 4), free_below=round(free_below, 4),
        reluctance=round(10**magnitude, 1),
    )  # fmt: skip


def _figures(controller: Controller, validation: ValidationSettings, options: dict[str, Any]) -> NDArray:
    """FIGURES of a controller in each validation episode (4, n)."""
    metrics = validate(controller, validation, options)
    return np.stack([getattr(metrics, name) for name in FIGURES])


def _ratios(own: NDArray, usual: NDArray, worst_bar: float) -> list[float]:
    """How the policy compares with the rival, 1 being equal.

    Upper 95 % ends of the mean figures over the rival's, and the tail of the excursion over `worst_bar`.

    Args:
        own: figures of the policy (4, n).
        usual: those of the rival (4, m), of the same episodes and more.
        worst_bar: tail of the excursion that counts as 1 [bar].
    """
    *means, excursion = own
    *its_means, _ = usual
    compared = [upper_ratio(mine, its) for mine, its in zip(means, its_means, strict=True)]
    return [*compared, tail(excursion) / worst_bar]


def upper_ratio(own: NDArray, usual: NDArray) -> float:
    """Upper 95 % end of mean(own) / mean(usual); 1 if the rival has none of it, as without consumption.

    The episodes are paired, and the rival's mean over all its episodes is known better: it is a control
    variate (Owen, Monte Carlo theory, methods and examples, 2013, section 8.9).

    Args:
        own: of the first n episodes (n,).
        usual: the rival's of these and more (m,).
    """
    mean, paired = float(usual.mean()), usual[: len(own)]
    if mean == 0:
        return 1.0
    spread = float(paired.var())
    slope = float(np.mean((own - own.mean()) * (paired - paired.mean()))) / spread if spread else 0.0
    rest = own - slope * paired
    share = float(rest.mean()) / mean
    error = np.hypot(rest.std() / len(own) ** 0.5, share * usual.std() / len(usual) ** 0.5) / mean
    return float(slope + share + 1.96 * error)


def tail(values: NDArray) -> float:
    """Mean of the largest hundredth of values (n,), one at least."""
    return float(np.sort(values)[-max(1, round(len(values) / 100)) :].mean())


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


def _settle_into(folder: Path, search: SettlingSearch, usual: NDArray) -> None:
    plant, policy = Plant.calibrated(), load_policy(folder)
    save_settings(settle(policy, plant, EPISODES, search, usual=usual, quiet=True), folder)
