"""Folders of learned policies: missing policies are trained in parallel, finished ones are loaded."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed
from tqdm import tqdm

from controllers.base import Controller
from controllers.learned import holds_policy, load_policy
from controllers.supervised import load_supervised
from epv_env.actions import OnOff
from epv_env.common.results_folder import only_writer
from epv_env.plant.consumption import MIXED
from epv_env.plant.plantfile import Plant
from epv_env.reward import RewardWeights
from training.evaluation.scenarios import TUNING_REGION
from training.learners.run_folder import STUDENT_FOLDER

MEMORYLESS_TIMESTEPS = 5_000_000
"""Environment steps of PPO for a policy without memory."""

RECURRENT_TIMESTEPS = 8_000_000
"""Environment steps of PPO for a recurrent policy."""

END_TO_END_TIMESTEPS = 8_000_000
"""The same if the recurrent unit learns, too."""

DISTILLATION_STEPS = 15_000_000
"""Environment steps of PPO that take about as long as a distillation (distillation.py)."""


@dataclass(frozen=True, kw_only=True)
class Training:
    """PPO on the report's plant within ±10 %."""

    folder: Path
    """Where the policy lies, or will."""
    timesteps: int
    """Environment steps of PPO."""
    seed: int
    """Of the training."""
    weights: RewardWeights = field(default_factory=RewardWeights)
    """Prices of the reward."""
    recurrent: bool = False
    """Whether the policy is recurrent (recurrent_training.py)."""
    end_to_end: bool = False
    """Whether its recurrent unit learns with PPO, too."""
    student: Path | None = None
    """Folder of the student that a recurrent policy goes on from; None: it is trained, too."""
    memoryless: Path | None = None
    """Folder of the policy without memory that PPO goes on from where switching is cheap; None: it is
    trained, too."""
    unusual: Mapping[str, Any] = field(default_factory=dict)
    """Hyperparameters of PPO that differ from the usual ones, by name: those of a short training."""

    @property
    def finished(self) -> bool:
        """Whether the folder holds the policy."""
        return holds_policy(self.folder)

    @property
    def cost(self) -> int:
        """Duration of the training in environment steps of PPO."""
        distils = self.recurrent and self.student is None
        return self.timesteps + (DISTILLATION_STEPS if distils else 0)

    @property
    def own_student(self) -> Path:
        """Folder of the student that a recurrent training makes if it is given none."""
        return self.folder / STUDENT_FOLDER

    def run(self, *, quiet: bool = False) -> None:
        """Train the policy. An interrupted training goes on. quiet: no progress bars."""
        from training.learners.distillation import FOR_END_TO_END, Distillation
        from training.learners.hyperparameters import Hyperparameters, recurrent_hyperparameters
        from training.learners.policy_files import save_policy  # torch takes seconds to import: only now
        from training.learners.ppo import train
        from training.learners.recurrent_training import train_recurrent

        task: dict[str, Any] = {
            "plant": Plant.calibrated(), "scenario": MIXED, "parameters": TUNING_REGION,
            "weights": self.weights, "timesteps": self.timesteps, "seed": self.seed, "device": "cpu",
            "folder": self.folder, "resume": True, "quiet": quiet,
        }  # fmt: skip
        with only_writer(self.folder):
            if self.recurrent:
                usual = recurrent_hyperparameters(self.weights, end_to_end=self.end_to_end)
                policy, log = train_recurrent(
                    replace(usual, **self.unusual),
                    FOR_END_TO_END if self.end_to_end else Distillation(),
                    student=self.student,
                    memoryless=self.memoryless,
                    **task,
                )
            else:
                policy, log = train(Hyperparameters(**self.unusual), **task)
            provenance = {
                "run": log.run.run, "timesteps": self.timesteps, "seed": self.seed,
                "switching_price": self.weights.switching,
            }  # fmt: skip
            save_policy(policy, self.folder, control_period=OnOff.default_period, provenance=provenance)


def train_missing(trainings: Sequence[Training], *, workers: int) -> None:
    """Train what is not finished. A policy does not depend on the number of processes, `workers`."""
    missing = [training for training in trainings if not training.finished]
    if workers == 1 or len(missing) < 2:
        for training in missing:
            training.run()
        return
    # The longest first, so that none is left running alone at the end.
    missing.sort(key=lambda training: -training.cost)
    total = sum(training.cost for training in missing)
    pool: Any = Parallel(n_jobs=workers, return_as="generator_unordered")
    with tqdm(total=total, desc="training", unit="step", unit_scale=True, file=sys.stderr) as bar:
        for cost in pool(delayed(_trained)(training) for training in missing):
            bar.update(cost)


def _trained(training: Training) -> int:
    """Train without a word; returns the cost."""
    training.run(quiet=True)
    return training.cost


def seed_folder(folder: Path, seed: int) -> Path:
    """Where the policy of a training seed lies among those of a folder."""
    return folder / f"seed-{seed}"


def seed_trainings(
    folder: Path, *, count: int, timesteps: int, recurrent: bool = False, end_to_end: bool = False
) -> list[Training]:
    """One for each training seed 0, 1, ..."""
    return [
        Training(
            folder=seed_folder(folder, seed), timesteps=timesteps, seed=seed, recurrent=recurrent,
            end_to_end=end_to_end,
        )
        for seed in range(count)
    ]  # fmt: skip


def seed_policies(trainings: Sequence[Training]) -> dict[str, Controller]:
    """The policies of finished trainings, by the name of their seed."""
    return {f"seed {training.seed}": load_policy(training.folder) for training in trainings}


def supervised_policies(trainings: Sequence[Training]) -> dict[str, Controller]:
    """The same under their supervisors."""
    return {f"seed {training.seed}": load_supervised(training.folder) for training in trainings}
