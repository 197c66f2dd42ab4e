"""Search the classic controllers' settings with the same budget for each.

    epv tune --trials 100 --out controllers/tuned.json
    epv tune --only "adaptive pulse" --out controllers/tuned.json    # keeps the file's others

The objective is the mean return on the training scenarios.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import optuna
from optuna.trial import Trial

from controllers.registration import Choice, SearchSpace
from controllers.registry import TUNED_KINDS, registration
from controllers.tuned import TUNED_FILE, Tuning, load_search, load_tunings, save_tunings
from epv_env.common.command_line import NextStep
from epv_env.common.options import Count, Seconds, Seed, writable_file
from epv_env.common.results_folder import progress
from epv_env.plant.plantfile import Plant
from training.evaluation.rollout import run_episodes
from training.evaluation.seeds import TUNING_SEED


def suggest(space: SearchSpace, trial: Trial) -> dict[str, Any]:
    """A trial's values of the quantities of a search space, by name."""
    return {
        name: trial.suggest_categorical(name, list(quantity.values))
        if isinstance(quantity, Choice)
        else trial.suggest_float(name, quantity.low, quantity.high, log=quantity.log)
        for name, quantity in space.items()
    }


def tune(
    kind: str, *, trials: int, episodes: int, duration: float, seed: int, options: dict[str, Any]
) -> Tuning:
    """Search one kind of controller.

    Args:
        kind: one of TUNED_KINDS.
        trials: evaluations of the search.
        episodes: episodes of an evaluation.
        duration: length of an episode [s].
        seed: of the search.
        options: of the environment.
    """
    space = registration(kind).search_space
    assert space is not None, f"{kind} has nothing to tune"
    seeds = list(range(TUNING_SEED, TUNING_SEED + episodes))
    study = optuna.create_study(
        direction="maximize", sampler=optuna.samplers.TPESampler(seed=seed, multivariate=True)
    )

    def objective(trial: Trial) -> float:
        values = suggest(space, trial)
        return _mean_return(kind, values, seeds=seeds, duration=duration, options=options)

    for _ in progress(range(trials), what=f"{kind:27s}"):
        study.optimize(objective, n_trials=1)
    return Tuning(
        values=study.best_params, trials=trials, mean_return=study.best_value, episodes=episodes,
        plants=options["parameters"],
    )  # fmt: skip


def _mean_return(kind: str, values: dict[str, Any], **scenarios: Any) -> float:
    """Mean return of a kind with these quantities. Values that contradict each other cost a trial."""
    try:
        controller = registration(kind).built(values, Plant.calibrated())
    except ValueError as contradiction:
        raise optuna.TrialPruned(str(contradiction)) from None
    metrics = run_episodes(controller, **scenarios)
    return float(metrics.episode_return.mean())


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


@dataclass(frozen=True, kw_only=True)
class Options:
    """The budget, and the file."""

    trials: Annotated[Count, "evaluations for each controller"] = 100
    episodes: Annotated[Count, "episodes of one evaluation"] = 128
    duration: Annotated[Seconds, "length of an episode [s]"] = 6.0
    seed: Annotated[Seed, "of the search"] = 0
    file: Annotated[Path, writable_file, {"flag": "--out"}, "JSON file to write"]
    only: Annotated[
        Sequence[str], {"choices": TUNED_KINDS, "nargs": "+"}, "kinds to search; --out keeps others"
    ] = ()


def run(options: Options) -> None:
    """Search, write the file and print what was found.

    Raises ValueError if --only would mix tunings of different budgets in one file.
    """
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    settings = {"trials": options.trials, "episodes": options.episodes, "duration": options.duration}
    search = {"method": "Optuna TPE on the mean return", **settings, "seed": options.seed}
    if options.only:
        kept(options.file, search)  # before the work, since it may refuse
    found = {
        kind: tune(
            kind, **settings, seed=options.seed, options={"parameters": registration(kind).tuned_on}
        )
        for kind in options.only or TUNED_KINDS
    }
    tunings = {**(kept(options.file, search) if options.only else {}), **found}
    ordered = {name: tunings[name] for name in sorted(tunings, key=TUNED_KINDS.index)}
    save_tunings(ordered, options.file, search)
    for kind, tuning in found.items():
        print(f"{kind}: mean return {tuning.mean_return:.1f} with {tuning.values}")


def next_step(options: Options) -> NextStep:
    """Compare what was tuned, which all commands read from one file."""
    kinds = options.only or TUNED_KINDS
    place = "" if options.file.resolve() == TUNED_FILE else f", once {options.file} is {TUNED_FILE}"
    return NextStep(f"to compare what was tuned{place}", ("compare", "--controllers", *kinds))
