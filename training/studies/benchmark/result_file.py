"""Files of benchmark results (epv-benchmark/1), to which others can add their algorithms."""

from collections.abc import Sequence
from os import PathLike
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from epv_env import MAX_EPISODE_STEPS
from epv_env.common.files import JSONFileError, read_json, write_json
from training.evaluation.benchmark import DURATION, EPISODES
from training.evaluation.seeds import BENCHMARK_SEED

FORMAT = "epv-benchmark/1"
REMEDY = "write it with training.studies.benchmark.result_file.write_results"


class Run(msgspec.Struct, kw_only=True):
    """One trained policy, or one controller that is not trained, and its figures."""

    seed: int | None = None
    """Of the training; None: not trained."""
    cpu_s: Annotated[float, Meta(ge=0.0)] | None = None
    """Processor time of the training [s]; None: not known."""
    mean_return: float
    """Mean return of the episodes [-]."""
    left_share: Annotated[float, Meta(ge=0.0, le=1.0)]
    """Share of the episodes in which p2 leaves target ±500 mbar after settling [1]."""
    rms_error_bar: Annotated[float, Meta(ge=0.0)]
    """Root mean square of p2 - target [bar]."""
    switchings_per_s: Annotated[float, Meta(ge=0.0)]
    """Switchings of the coil per second."""


class Entry(msgspec.Struct, kw_only=True):
    """An algorithm on an environment."""

    algorithm: str
    """Name in tables."""
    environment: str
    """Id."""
    timesteps: Annotated[int, Meta(ge=1)] | None = None
    """Environment steps of each training; None: not trained."""
    source: str = ""
    """Library and version, or where to find the code."""
    hyperparameters: dict[str, Any] = {}
    """What differs from the source's defaults."""
    runs: list[Run]
    """One for each training seed."""


class Results(msgspec.Struct, kw_only=True):
    """All entries, on the same episodes."""

    format: str = FORMAT
    episodes: int = EPISODES
    """Episodes behind each run's figures."""
    duration_s: float = DURATION
    """Length of an episode."""
    first_seed: int = BENCHMARK_SEED
    """Seed of the first episode."""
    entries: list[Entry]


def write_results(path: str | PathLike[str], results: Results) -> None:
    """Write results, whole or not at all. Raises ValueError for a number that is not finite."""
    write_json(path, msgspec.to_builtins(results), allow_nan=False)


def read_results(path: str | PathLike[str]) -> Results:
    """The results in a file.

    Raises JSONFileError (see read_json), also for an unknown environment and an entry without a run.
    """
    results = read_json(path, Results, version=FORMAT, remedy=REMEDY)
    for number, entry in enumerate(results.entries):
        where = f"{path}, entries[{number}]"
        if entry.environment not in MAX_EPISODE_STEPS:
            known = ", ".join(MAX_EPISODE_STEPS)
            raise JSONFileError(f"{where}: unknown environment {entry.environment!r}: give {known}")
        if not entry.runs:
            raise JSONFileError(f"{where}: {entry.algorithm} has no runs: give one at least")
    return results


def joined(own: Results, others: Sequence[Results]) -> Results:
    """All entries in one. Raises ValueError for results on other episodes, and if a name is taken."""
    for other in others:
        if (other.episodes, other.duration_s, other.first_seed) != (
            own.episodes, own.duration_s, own.first_seed,
        ):  # fmt: skip
            raise ValueError(
                f"results on {other.episodes} episodes of {other.duration_s:g} s from seed "
                f"{other.first_seed} on cannot stand beside those on {own.episodes} of "
                f"{own.duration_s:g} s from {own.first_seed} on: score on the same"
            )
    entries = [entry for results in (own, *others) for entry in results.entries]
    names = [(entry.environment, entry.algorithm) for entry in entries]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(
            f"two entries of {twice[0][0]} are called {twice[0][1]!r}: give yours another name"
        )
    return Results(
        episodes=own.episodes, duration_s=own.duration_s, first_seed=own.first_seed, entries=entries
    )  # fmt: skip
