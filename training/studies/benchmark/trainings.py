"""The benchmark's trainings and references, run one after another; what is finished stays finished."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Protocol

import msgspec
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from controllers.base import Controller
from controllers.learned import TRAINED, load_policy
from controllers.tuned import build, load_tunings
from epv_env.common.files import Journal
from epv_env.plant.plantfile import Plant
from training.evaluation.benchmark import score
from training.learners.library_algorithms import Algorithm, described
from training.learners.library_policy import LibraryPolicy
from training.learners.library_training import train_library_algorithm
from training.learners.tracking import tracked
from training.studies.benchmark.result_file import Entry, Run

REFERENCE_KINDS = ("hysteresis", "hysteresis, extrapolating", "pulse, adaptive", "PWM")
"""Tuned controllers that stand beside the algorithms."""
REFERENCE_POLICIES = {
    "packaged PPO": "plain/seed-0",
    "packaged recurrent PPO": "recurrent/seed-7",
    "packaged end-to-end PPO": "end-to-end/seed-0",
}
"""Policies of the package by their names in tables."""

_PACKAGES = {"stable_baselines3": "stable-baselines3", "sb3_contrib": "sb3-contrib"}
"""Distributions by the names under which they are imported."""


@dataclass(frozen=True, kw_only=True)
class Training:
    """One training seed of an algorithm on an environment."""

    algorithm: Algorithm
    environment: str
    seed: int

    @property
    def name(self) -> str:
        """Its own in the benchmark, and its folder."""
        return f"{self.environment}/{self.algorithm.name}/seed-{self.seed}"


@dataclass(frozen=True, kw_only=True)
class Size:
    """What all trainings and scores share."""

    timesteps: int
    """Environment steps of a training."""
    episodes: int
    """Episodes of a score."""
    duration: float
    """Length of one of them [s]."""


class Progress(Protocol):
    """Takes in the progress of the whole benchmark."""

    def begin(self, name: str) -> None:
        """The training of this name begins."""
        ...

    def add(self, microseconds: float) -> None:
        """So much of the estimated work is done [us]."""
        ...


class _Bar:
    """Shows a tqdm bar; its unit is the estimated work, so that the time left is, too."""

    def __init__(self, bar: tqdm):
        self._bar = bar

    def begin(self, name: str) -> None:
        self._bar.set_postfix_str(name)

    def add(self, microseconds: float) -> None:
        self._bar.update(microseconds)


@contextmanager
def progress_bar(trainings: Sequence[Training], timesteps: int) -> Iterator[Progress]:
    """A bar on stderr for these trainings."""
    total = sum(timesteps * training.algorithm.microseconds for training in trainings)
    with tqdm(
        total=max(total, 1), desc=f"{len(trainings)} trainings", file=sys.stderr,
        mininterval=0.5 if sys.stderr.isatty() else 10.0,
        disable=not trainings,
        bar_format="{desc}: {percentage:3.0f}%|{bar}| {elapsed}<{remaining}{postfix}",
    ) as bar:  # fmt: skip
        yield _Bar(bar)


def run_trainings(
    trainings: Sequence[Training], size: Size, journal: Journal, folder: Path, *, track: bool
) -> None:
    """Train and score those that the journal lacks.

    Args:
        trainings: each with a name of its own.
        size: of each.
        journal: takes the figures of each as soon as it is finished.
        folder: of the models, by the trainings' names.
        track: whether Weights & Biases shows them.
    """
    missing = [training for training in trainings if training.name not in journal]
    with progress_bar(missing, size.timesteps) as progress, threadpool_limits(1):
        for training in missing:
            progress.begin(training.name)
            journal.add(training.name, _trained(training, size, folder, progress, track=track))


def _trained(
    training: Training, size: Size, folder: Path, progress: Progress, *, track: bool
) -> dict[str, Any]:
    """The Run of a training, ready for JSON."""
    algorithm, own = training.algorithm, folder / training.name
    config = {**described(algorithm), "algorithm": algorithm.name, "seed": training.seed}
    with tracked(track, name=training.name, folder=own, config=config):
        trained = train_library_algorithm(
            algorithm, training.environment, seed=training.seed, timesteps=size.timesteps, folder=own,
            progress=lambda steps: progress.add(steps * algorithm.microseconds),
        )  # fmt: skip
    policy = LibraryPolicy(model=trained.model, environment=training.environment)
    figures = score(policy, episodes=size.episodes, duration=size.duration)
    return msgspec.to_builtins(Run(seed=training.seed, cpu_s=round(trained.cpu_s, 1), **figures))


def entries(trainings: Sequence[Training], size: Size, journal: Journal) -> list[Entry]:
    """What the journal holds of these trainings, an entry for each algorithm and environment."""
    found: dict[tuple[str, str], Entry] = {}
    for training in trainings:
        if training.name not in journal:
            continue
        algorithm = training.algorithm
        package = _PACKAGES[algorithm.module]
        entry = found.setdefault(
            (training.environment, algorithm.name),
            Entry(
                algorithm=algorithm.label, environment=training.environment, timesteps=size.timesteps,
                source=f"{package} {version(package)}", hyperparameters=described(algorithm),
                runs=[],
            ),
        )  # fmt: skip
        entry.runs.append(msgspec.convert(journal[training.name], Run))
    return list(found.values())


def reference_entries(environments: Sequence[str], size: Size, journal: Journal) -> list[Entry]:
    """Controllers of the project on the environments that they are for."""
    found = []
    for name, controller in references().items():
        if controller.environment not in environments:
            continue
        key = f"reference/{name}"
        if key not in journal:
            journal.add(key, score(controller, episodes=size.episodes, duration=size.duration))
        run = Run(**journal[key])
        found.append(
            Entry(algorithm=name, environment=controller.environment, source="epv-valve", runs=[run])
        )
    return found


def references() -> dict[str, Controller]:
    """The references by their names in tables."""
    tunings, plant = load_tunings(), Plant.calibrated()
    classic = {kind: build(kind, tunings[kind].values, plant) for kind in REFERENCE_KINDS}
    learned = {name: load_policy(TRAINED / folder) for name, folder in REFERENCE_POLICIES.items()}
    return {**classic, **learned}
