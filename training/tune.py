"""Tune the classic controllers: the same budget, scenarios and objective for each.

    python training/tune.py --trials 100 --out controllers/tuned.json
    python training/tune.py --only pulse --out controllers/tuned.json    # keeps the file's others
    python training/tune.py --only pulse --objective margin --out controllers/tuned.json    # the same

The objective is the mean return on the training scenarios: of the task's reward, or of the stricter one
with which a recurrent policy is trained.
"""

import training.console.missing_packages  # noqa: F401 - before what may be missing

# isort: split
import argparse
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import optuna
from optuna.trial import Trial
from tqdm import tqdm

from controllers.registration import Choice, Range, SearchSpace
from controllers.registry import TUNED_KINDS, WITH_MARGIN, kind_of, registration
from controllers.tuned import Tuning, load_search, load_tunings, save_tunings
from epv_env.common.command_line import (
    check_not_negative,
    check_positive,
    fail_clearly,
    writable_file,
)
from epv_env.plant.plantfile import Plant
from epv_env.reward import RewardWeights
from training.evaluation.rollout import run_episodes
from training.evaluation.scenarios import TUNING_REGION
from training.evaluation.seeds import TUNING_SEED
from training.learners.hyperparameters import FROM_STUDENT, training_weights

OBJECTIVES = {
    "reward": RewardWeights(),
    "margin": training_weights(RewardWeights(), FROM_STUDENT),
}
"""Prices whose return a search maximises: the task's, or those of a recurrent policy's training, with a
narrower band and a dearer breakdown."""

WIDENINGS = 2
"""Most repetitions of a kind's search, each wider than the one before. Two quadruple a range, or reach
its physical limit."""


def suggest(space: SearchSpace, trial: Trial) -> dict[str, Any]:
    """A trial's values of the quantities of a search space, by name."""
    return {name: _suggested(name, quantity, trial) for name, quantity in space.items()}


def _suggested(name: str, quantity: Range | Choice, trial: Trial) -> Any:
    if isinstance(quantity, Choice):
        return trial.suggest_categorical(name, list(quantity.values))
    return trial.suggest_float(name, quantity.low, quantity.high, log=quantity.log)


def budget(kind: str, trials: int, episodes: int) -> tuple[int, int]:
    """Trials of a kind's search and episodes of a trial: at most what its cost class allows."""
    cost = registration(kind).cost
    return min(trials, cost.most_trials or trials), min(episodes, cost.most_episodes or episodes)


def tune(
    kind: str, *, trials: int, episodes: int, duration: float, seed: int, options: dict[str, Any]
) -> Tuning:
    """Search one kind of controller; a search that ends at a bound is widened and run again.

    Args:
        kind: one of TUNED_KINDS.
        trials: evaluations of a search (`budget` may allow fewer).
        episodes: episodes of an evaluation (`budget` may allow fewer).
        duration: length of an episode [s].
        seed: of the search.
        options: of the environment.
    """
    space = registration(kind).search_space
    assert space is not None, f"{kind} has nothing to tune"
    trials, episodes = budget(kind, trials, episodes)
    run = partial(
        _mean_return, kind, seeds=list(range(TUNING_SEED, TUNING_SEED + episodes)),
        duration=duration, options=options,
    )  # fmt: skip
    study, searched = _search(kind, space, run, trials, seed), space
    for _ in range(WIDENINGS):
        wider = widened(searched, study.best_params)
        if wider == searched:
            break
        print(f"{kind}: the search ended at a bound; searching wider: {_named(searched, wider)}")
        study, searched = _search(kind, wider, run, trials, seed, study.best_params), wider
    if widened(searched, study.best_params) != searched:
        print(f"{kind}: the search ended at a bound again after {WIDENINGS} wider ones; it is kept")
    return Tuning(
        values=study.best_params, trials=trials, mean_return=study.best_value, episodes=episodes,
        widened=_named(space, searched),
    )  # fmt: skip


def widened(space: SearchSpace, values: Mapping[str, Any]) -> SearchSpace:
    """The space to search next after `values` were found in `space`; itself if none is at a bound."""
    return {
        name: quantity if isinstance(quantity, Choice) else quantity.widened(values[name])
        for name, quantity in space.items()
    }


def _named(before: SearchSpace, after: SearchSpace) -> dict[str, tuple[float, float]]:
    """The ranges of `after` that differ from `before`, by name."""
    return {
        name: (quantity.low, quantity.high)
        for name, quantity in after.items()
        if isinstance(quantity, Range) and quantity != before[name]
    }


def _mean_return(kind: str, values: dict[str, Any], **scenarios: Any) -> float:
    """Mean return of a kind with these quantities. Values that contradict each other cost a trial."""
    try:
        controller = registration(kind).built(values, Plant.calibrated())
    except ValueError as contradiction:
        raise optuna.TrialPruned(str(contradiction)) from None
    metrics, _ = run_episodes(controller, **scenarios)
    return float(metrics.episode_return.mean())


def _search(
    kind: str, space: SearchSpace, run: Callable[[dict[str, Any]], float], trials: int, seed: int,
    first: Mapping[str, Any] | None = None,
) -> optuna.Study:  # fmt: skip
    """One search of a space. first: values to try first, so that the outcome is no worse than they."""
    study = optuna.create_study(
        direction="maximize", sampler=optuna.samplers.TPESampler(seed=seed, multivariate=True)
    )
    if first is not None:
        study.enqueue_trial(dict(first))
    with tqdm(total=trials, desc=f"{kind:27s}", unit="trial") as bar:

        def count(*_: Any) -> None:
            bar.update()

        study.optimize(lambda trial: run(suggest(space, trial)), n_trials=trials, callbacks=[count])
    return study


def kept(path: Path, search: dict[str, Any]) -> dict[str, Tuning]:
    """What a file holds already. Raises ValueError if that was searched otherwise: budgets are equal."""
    if not path.exists():
        return {}
    if load_search(path) != search:
        raise ValueError(
            f"{path} was searched with {load_search(path)}, not {search}: search all kinds anew "
            "(leave --only out), or choose another --out"
        )
    return load_tunings(path)


def named(kind: str, objective: str) -> str:
    """The name of the controller of a kind that was tuned under an objective."""
    return kind if objective == "reward" else kind + WITH_MARGIN


def ordered(tunings: Mapping[str, Tuning]) -> dict[str, Tuning]:
    """Tunings by name in the registry's order, each kind's own objective before the stricter one."""
    return {
        name: tunings[name]
        for name in sorted(tunings, key=lambda name: (TUNED_KINDS.index(kind_of(name)), name))
    }


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(description="Tune the classic controllers.")
    parser.add_argument("--trials", type=int, default=100, help="evaluations for each controller")
    parser.add_argument("--episodes", type=int, default=128, help="episodes of one evaluation")
    parser.add_argument("--duration", type=float, default=6.0, help="length of an episode [s]")
    parser.add_argument("--seed", type=int, default=0, help="of the search")
    parser.add_argument(
        "--objective", choices=OBJECTIVES, default="reward",
        help="whose mean return is maximised; 'margin': the prices of a recurrent policy's training",
    )  # fmt: skip
    parser.add_argument("--out", type=writable_file, required=True, help="JSON file to write")
    parser.add_argument(
        "--only", choices=TUNED_KINDS, nargs="+", help="kinds to search; --out keeps others"
    )
    chosen = parser.parse_args(arguments)
    check_positive(parser, chosen, "trials", "episodes", "duration")
    check_not_negative(parser, chosen, "seed")
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    settings = {"trials": chosen.trials, "episodes": chosen.episodes, "duration": chosen.duration}
    region = {"parameters": TUNING_REGION}
    search = {"method": "Optuna TPE on the mean return", **settings, "seed": chosen.seed, **region}
    keeps_others = chosen.only or chosen.objective != "reward"
    if keeps_others:
        kept(chosen.out, search)  # before the work, since it may refuse
    options = {**region, "weights": OBJECTIVES[chosen.objective]}
    tunings = {
        named(kind, chosen.objective): replace(
            tune(kind, **settings, seed=chosen.seed, options=options), objective=chosen.objective
        )
        for kind in chosen.only or TUNED_KINDS
    }
    others = kept(chosen.out, search) if keeps_others else {}
    save_tunings(ordered({**others, **tunings}), chosen.out, search)
    for kind, tuning in tunings.items():
        print(f"{kind}: mean return {tuning.mean_return:.1f} with {tuning.values}")
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
