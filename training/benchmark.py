"""Train algorithms of stable-baselines3 and sb3-contrib on equal terms, and score them.

    python training/benchmark.py --algo ppo sac --env EPValvePWM-v0 --out runs/benchmark

docs/results/benchmark.md holds the protocol and the results. Finished trainings in --out are kept: an
interrupted benchmark continues with the next one, and more algorithms or seeds can be added to it.
"""

import argparse
import hashlib
import json
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

from epv_env import MAX_EPISODE_STEPS
from epv_env.common.command_line import (
    check_positive,
    fail_clearly,
    parse_with_quick,
    writable_folder,
)
from epv_env.common.files import Journal
from epv_env.common.results_folder import check_options, only_writer, write_options
from training.evaluation.benchmark import DURATION, EPISODES
from training.evaluation.seeds import BENCHMARK_SEED, training_seeds
from training.learners.library_algorithms import ALGORITHMS, NUM_ENVS, described
from training.learners.provenance import PACKAGES
from training.learners.tracking import HELP, check_tracking
from training.studies.benchmark.result_file import Results, joined, read_results, write_results
from training.studies.benchmark.score_table import score_table
from training.studies.benchmark.trainings import (
    Size,
    Training,
    entries,
    reference_entries,
    run_trainings,
)
from training.studies.generated_pages import check_pages, fill

RESULT_FILE, JOURNAL_FILE, FIGURE_FILE = "benchmark.json", "trainings.jsonl", "benchmark.png"
TIMESTEPS = 102_400
"""Environment steps of a training: 50 rollouts of the algorithms that learn from whole ones."""

QUICK: dict[str, Any] = {
    "algo": ["a2c"], "seeds": 1, "timesteps": 400, "episodes": 4, "duration": 0.6,
}  # fmt: skip
"""The defaults under --quick: too little to learn or to conclude anything."""


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line's options, checked."""
    parser = argparse.ArgumentParser(
        description="Train algorithms of stable-baselines3 and sb3-contrib, and score them."
    )
    parser.add_argument("--out", type=writable_folder, default=Path("runs/benchmark"))
    parser.add_argument(
        "--algo", nargs="+", choices=list(ALGORITHMS), default=list(ALGORITHMS), metavar="NAME",
        help=f"of {', '.join(ALGORITHMS)}; each is trained where it can act",
    )  # fmt: skip
    parser.add_argument(
        "--env", nargs="+", choices=list(MAX_EPISODE_STEPS), default=list(MAX_EPISODE_STEPS),
        help="environments",
    )  # fmt: skip
    parser.add_argument("--seeds", type=int, default=5, help="training seeds of each, from 0 on")
    parser.add_argument(
        "--timesteps", type=int, default=TIMESTEPS, help="environment steps of each training"
    )
    parser.add_argument("--episodes", type=int, default=EPISODES, help="of a score")
    parser.add_argument("--duration", type=float, default=DURATION, help="length of one of them [s]")
    parser.add_argument(
        "--beside", type=Path, nargs="+", default=[], metavar="FILE",
        help="results of others (epv-benchmark/1) that tables and figure show, too",
    )  # fmt: skip
    parser.add_argument("--track", action="store_true", help=HELP)
    parser.add_argument("--images", type=writable_folder, help="another folder for the figure")
    parser.add_argument(
        "--pages", type=Path, nargs="+", default=[], help="pages whose generated parts are written"
    )
    chosen = parse_with_quick(parser, arguments, QUICK)
    check_positive(parser, chosen, "seeds", "timesteps", "episodes", "duration")
    training_seeds(chosen.seeds - 1, NUM_ENVS)  # refuses too many
    for name in chosen.algo:
        able = ALGORITHMS[name].environments
        if not set(able) & set(chosen.env):
            parser.error(f"--algo {name} cannot act in {chosen.env[0]}: add --env {able[0]}")
    return chosen


def planned(chosen: argparse.Namespace) -> list[Training]:
    """The trainings, seed by seed: so an interrupted benchmark has as many of each algorithm."""
    return [
        Training(algorithm=algorithm, environment=environment, seed=seed)
        for seed in range(chosen.seeds)
        for environment in MAX_EPISODE_STEPS
        for name, algorithm in ALGORITHMS.items()
        if name in chosen.algo and environment in chosen.env and environment in algorithm.environments
    ]


def configuration(chosen: argparse.Namespace) -> dict[str, Any]:
    """All that a training's figures depend on but its algorithm, environment and seed."""
    settings = {name: described(algorithm) for name, algorithm in ALGORITHMS.items()}
    digest = hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()
    packages = ("epv-valve", *PACKAGES, "sb3-contrib")
    return {
        **{name: getattr(chosen, name) for name in ("timesteps", "episodes", "duration")},
        "first_seed": BENCHMARK_SEED,
        "hyperparameters": digest[:12],
        "versions": {package: version(package) for package in packages},
    }


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    chosen = parse(arguments)
    check_tracking(chosen.track)
    check_pages(chosen.pages, chosen.env)
    others = [read_results(path) for path in chosen.beside]
    with only_writer(chosen.out):
        return benchmark(chosen, others)


def benchmark(chosen: argparse.Namespace, others: list[Results]) -> int:
    """Run what --out lacks, and write results, tables and figure; returns the exit status."""
    size = Size(timesteps=chosen.timesteps, episodes=chosen.episodes, duration=chosen.duration)
    joined(_results([], size), others)  # refuses before the work
    config = configuration(chosen)
    check_options(chosen.out, config, "benchmark")
    write_options(chosen.out, config)
    journal = Journal(chosen.out / JOURNAL_FILE, config)
    references = reference_entries(chosen.env, size, journal)
    trainings = planned(chosen)
    run_trainings(trainings, size, journal, chosen.out, track=chosen.track)
    own = _results([*entries(trainings, size, journal), *references], size)
    write_results(chosen.out / RESULT_FILE, own)
    report(joined(own, others), chosen)
    return 0


def _results(found: list[Any], size: Size) -> Results:
    return Results(episodes=size.episodes, duration_s=size.duration, entries=found)


def report(results: Results, chosen: argparse.Namespace) -> None:
    """Print the chosen environments' tables, and write pages and figure."""
    from training.evaluation.plots import save_figure
    from training.studies.benchmark.score_figure import score_figure

    shown = [entry for entry in results.entries if entry.environment in chosen.env]
    tables = {environment: score_table(shown, environment) for environment in chosen.env}
    for page in chosen.pages:
        fill(page, tables)
    folder = chosen.images or chosen.out
    save_figure(score_figure(shown), folder / FIGURE_FILE)
    for environment in chosen.env:
        print(f"{environment}\n\n{tables[environment]}\n")
    print(f"results in {chosen.out}")


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
