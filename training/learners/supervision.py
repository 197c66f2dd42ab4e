"""What training settles last: how high a policy's supervisor holds p2, which pulses it holds back, and
which it ends.

A higher p2 means a smaller breakdown and a larger rms error. Fewer pulses mean fewer switchings and a
larger breakdown, pulses that end early a smaller rms error and more switchings. The adaptive pulse, the
best of the classic controllers, shows on validation episodes what is usual of all three. Each figure's
ratio to the rival's has a 95 % interval. The three upper ends alone would let the policy come closer to
the band's ends, so a fourth ratio bounds the excursion of the worst episodes. The largest of the four is
minimised (an achievement scalarising function: Miettinen, Nonlinear Multiobjective Optimization, Kluwer
1999), as a variable that none of them may exceed: each ratio is smooth in the settings, their largest is
not.
"""

import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from tqdm import tqdm

from controllers.adaptive_pulse import REGISTRATION
from controllers.base import Controller
from controllers.learned import LearnedPolicy, load_policy
from controllers.supervised import SupervisorFile, load_settings, save_settings, supervised
from controllers.supervisor_settings import SupervisorSettings
from controllers.tuned import build, load_tunings
from epv_env.plant.consumption import MIXED
from epv_env.plant.plantfile import Plant
from training.evaluation.scenarios import TUNING_REGION
from training.learners.settling_search import SETTLING, SettlingSearch, Trials, at_bounds
from training.learners.validation import ValidationSettings, validate

FIGURES = ("rms_bar", "event_breakdown_bar", "switchings_per_s", "excursion_bar")
"""What the settings trade against each other, as `EpisodeMetrics` calls it."""

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
    with tqdm(total=search.evaluations, desc="supervisor", unit="trial", disable=quiet) as bar:
        rival = usual_figures(plant, options, search) if usual is None else usual

        def ratios(settings: SupervisorSettings) -> list[float]:
            own = _figures(
                supervised(policy, plant, settings), search.validation, {"plant": plant, **options}
            )
            bar.update()
            return _ratios(own, rival, search.worst_bar)

        trials = Trials(ratios, search)
        trials.run_round()
        for _ in range(1, search.rounds):
            if trials.largest(trials.best) <= search.again_above:
                break
            bar.total += search.evaluations
            trials.run_round()
    best = trials.best
    ended = at_bounds(best, search)
    if ended:
        tqdm.write(
            f"supervisor of {policy.name!r}: the search of {', '.join(ended)} ended at a bound, "
            "so better settings may lie beyond: widen SettlingSearch "
            "(training/learners/settling_search.py)",
            file=sys.stderr,
        )
    how = {**asdict(search), "largest_ratio": trials.largest(best), "at_bound": ended}
    return SupervisorFile(settings=best, search=how)


def usual_figures(plant: Plant, options: dict[str, Any], search: SettlingSearch = SETTLING) -> NDArray:
    """FIGURES of the tuned adaptive pulse in each episode (4, n); arguments as those of `settle`."""
    rival = build(REGISTRATION.kind, load_tunings()[REGISTRATION.kind].values, plant)
    return _figures(rival, search.rival, {"plant": plant, **options})


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
