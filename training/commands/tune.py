"""Search the classic controllers' settings with the same budget for each.

    epv tune --trials 100 --out controllers/tuned.json
    epv tune --only "adaptive pulse" --out controllers/tuned.json    # keeps the file's others

The objective is the mean return on the training scenarios.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import optuna
from optuna.trial import Trial

from controllers.registration import Choice, Range, SearchSpace
from controllers.registry import TUNED_KINDS, registration
from controllers.tuned import TUNED_FILE, Tuning, load_search, load_tunings, save_tunings
from epv_env.common.command_line import NextStep
from epv_env.common.options import Count, Seconds, Seed, writable_file
from epv_env.common.results_folder import progress
from epv_env.plant.plantfile import Plant
from training.evaluation.rollout import run_episodes
from training.evaluation.seeds import TUNING_SEED

WIDENINGS = 2
"""Most repetitions of a kind's search, each wider than the one before. Two quadruple a range, or reach
its physical limit."""


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
    """Search one kind of controller; a search that ends at a bound is widened and run again.

    Args:
        kind: one of TUNED_KINDS.
        trials: evaluations of a search.
        episodes: episodes of an evaluation.
        duration: length of an episode [s].
        seed: of the search.
        options: of the environment.
    """
    space = registration(kind).search_space
    assert space is not None, f"{kind} has nothing to tune"
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
        widened=_named(space, searched), plants=options["parameters"],
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
    metrics = run_episodes(controller, **scenarios)
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
    for _ in progress(range(trials), what=f"{kind:27s}"):
        study.optimize(lambda trial: run(suggest(space, trial)), n_trials=1)
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
