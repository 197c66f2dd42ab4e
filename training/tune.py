"""Tune the classic controllers: the same budget, scenarios and objective for each.

    python training/tune.py --trials 100 --out controllers/tuned.json
    python training/tune.py --only pulse --out controllers/tuned.json    # keeps the file's others

The objective is the mean return on the training scenarios, the very reward that PPO maximises.
"""

import argparse
import sys
from pathlib import Path
from typing import Any

import optuna
from optuna.trial import Trial
from tqdm import tqdm

from controllers.tuned import KINDS, Tuning, build, load_search, load_tunings, save_tunings
from epv_env.common.command_line import (
    check_not_negative,
    check_positive,
    fail_clearly,
    writable_file,
)
from epv_env.observation import P2_LAGS
from epv_env.plant.parameters import Parameters
from training.evaluation.rollout import run_episodes
from training.evaluation.scenarios import TUNING_REGION
from training.evaluation.seeds import TUNING_SEED

REDUCED = {"MPC": (16, 32)}
"""Trials, and episodes of each, of kinds that simulate the plant as they decide: a thousandfold the
computing of the others buys them less than an equal budget, not more."""


def search_space(kind: str, trial: Trial) -> dict[str, Any]:
    """The quantities searched for a kind of controller, with their ranges."""
    if kind == "PWM":
        return {
            "inner_time": trial.suggest_float("inner_time", 0.01, 0.06, log=True),
            "phase_margin": trial.suggest_float("phase_margin", 20.0, 60.0),
            "integral_time": trial.suggest_float("integral_time", 0.2, 3.0, log=True),
            "depth": trial.suggest_float("depth", 0.03, 0.8, log=True),
            "setpoint": trial.suggest_float("setpoint", -0.3, 0.2),
            "engage_below": trial.suggest_float("engage_below", -0.4, 0.3),
            "rest_above": trial.suggest_float("rest_above", -0.3, 0.4),
        }
    if kind == "pulse":
        return {
            "trigger": trial.suggest_float("trigger", -0.3, 0.1),
            "aim": trial.suggest_float("aim", -0.1, 0.3),
            "filter_time": trial.suggest_float("filter_time", 0.004, 0.04, log=True),
            "look_ahead": trial.suggest_float("look_ahead", 0.3, 1.5),
            "rounding": trial.suggest_float("rounding", 0.2, 1.2),
        }
    if kind == "MPC":
        return {
            "tail": trial.suggest_float("tail", 0.02, 0.3, log=True),
            "floor": trial.suggest_float("floor", -0.2, 0.0),
            "upkeep": trial.suggest_float("upkeep", 5.0, 40.0),
            "setpoint": trial.suggest_float("setpoint", -0.05, 0.15),
            "reluctance": trial.suggest_float("reluctance", 0.0, 0.2),
        }
    values: dict[str, Any] = {
        "open_below": trial.suggest_float("open_below", -0.45, 0.3),
        "shut_above": trial.suggest_float("shut_above", -0.45, 0.45),
    }
    if kind == "hysteresis, extrapolating":
        values["open_lookahead"] = trial.suggest_float("open_lookahead", 0.0, 0.15)
        values["shut_lookahead"] = trial.suggest_float("shut_lookahead", 0.0, 0.06)
        values["lag"] = trial.suggest_categorical("lag", list(P2_LAGS))
    return values


def tune(
    kind: str, *, trials: int, episodes: int, duration: float, seed: int, options: dict[str, Any]
) -> Tuning:
    """Search one kind of controller. Values that contradict each other cost a trial."""
    parameters = Parameters.calibrated()
    most_trials, most_episodes = REDUCED.get(kind, (trials, episodes))
    trials, fewer = min(trials, most_trials), min(episodes, most_episodes)
    seeds = list(range(TUNING_SEED, TUNING_SEED + fewer))

    def objective(trial: Trial) -> float:
        try:
            controller = build(kind, search_space(kind, trial), parameters)
        except ValueError as contradiction:
            raise optuna.TrialPruned(str(contradiction)) from None
        metrics, _ = run_episodes(controller, seeds=seeds, duration=duration, options=options)
        return float(metrics.episode_return.mean())

    study = optuna.create_study(
        direction="maximize", sampler=optuna.samplers.TPESampler(seed=seed, multivariate=True)
    )
    with tqdm(total=trials, desc=f"{kind:27s}", unit="trial") as bar:

        def count(*_: Any) -> None:
            bar.update()

        study.optimize(objective, n_trials=trials, callbacks=[count])
    return Tuning(
        values=study.best_params, trials=trials, mean_return=study.best_value, episodes=fewer
    )  # fmt: skip


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


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(description="Tune the classic controllers.")
    parser.add_argument("--trials", type=int, default=100, help="evaluations for each controller")
    parser.add_argument("--episodes", type=int, default=128, help="episodes of one evaluation")
    parser.add_argument("--duration", type=float, default=6.0, help="length of an episode [s]")
    parser.add_argument("--seed", type=int, default=0, help="of the search")
    parser.add_argument("--out", type=writable_file, required=True, help="JSON file to write")
    parser.add_argument("--only", choices=KINDS, nargs="+", help="kinds to search; --out keeps others")
    chosen = parser.parse_args(arguments)
    check_positive(parser, chosen, "trials", "episodes", "duration")
    check_not_negative(parser, chosen, "seed")
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    options = {"parameters": TUNING_REGION}
    settings = {"trials": chosen.trials, "episodes": chosen.episodes, "duration": chosen.duration}
    search = {"method": "Optuna TPE on the mean return", **settings, "seed": chosen.seed, **options}
    if chosen.only:
        kept(chosen.out, search)  # before the work, since it may refuse
    tunings = {
        kind: tune(kind, **settings, seed=chosen.seed, options=options) for kind in chosen.only or KINDS
    }
    others = kept(chosen.out, search) if chosen.only else {}
    save_tunings({**others, **tunings}, chosen.out, search)
    for kind, tuning in tunings.items():
        print(f"{kind}: mean return {tuning.mean_return:.1f} with {tuning.values}")
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
