"""Training of a recurrent policy: distillation of a privileged teacher, then PPO.

The teacher lets the valve rest. Where switching is so cheap that resting does not pay, PPO trains a
policy without memory first, and goes on from this policy with the student's recurrent unit.
"""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from controllers.learned import LearnedPolicy, holds_policy, load_policy
from controllers.privileged_pulse import PrivilegedPulse
from epv_env.actions import OnOff
from training.learners.distillation import Distillation, distil, known_plants
from training.learners.hyperparameters import Hyperparameters, switching_is_cheap
from training.learners.learning_log import TrainingLog
from training.learners.policy_files import save_policy
from training.learners.ppo import train
from training.learners.student import STUDENT_FOLDER, load_student, with_memory_of

MEMORYLESS_FOLDER = "memoryless"


def train_recurrent(
    h: Hyperparameters,
    d: Distillation,
    *,
    folder: Path,
    resume: bool,
    student: Path | None = None,
    memoryless: Path | None = None,
    quiet: bool = False,
    **task: Any,
) -> tuple[LearnedPolicy, TrainingLog]:
    """Train a student, kept in a folder within `folder`, and go on from it with PPO.

    Where switching is cheap PPO goes on from a policy without memory, which it has trained and kept
    beside the student, and gives it the student's recurrent unit. An interruption loses an unfinished
    student, and no more of the rest than `train` does.

    Args:
        h: hyperparameters of PPO.
        d: what defines the distillation.
        folder: of the recurrent policy.
        resume: whether to go on from what the folder holds.
        student: folder of a finished student; None: it is trained.
        memoryless: folder of a finished policy without memory; None: it is trained if it is needed.
        quiet: no progress bars.
        task: `train`'s other arguments.
    """
    if student is None:
        student = folder / STUDENT_FOLDER
        if not (resume and holds_policy(student)):
            _distil_into(student, d, quiet=quiet, **task)
    begun = load_student(student, h)
    if switching_is_cheap(task["weights"]):
        if memoryless is None:
            memoryless = folder / MEMORYLESS_FOLDER
            if not (resume and holds_policy(memoryless)):
                _train_memoryless_into(memoryless, h, resume=resume, quiet=quiet, **task)
        begun = with_memory_of(begun, load_policy(memoryless))
    return train(h, folder=folder, student=begun, resume=resume, quiet=quiet, **task)


def _distil_into(folder: Path, d: Distillation, *, quiet: bool, **task: Any) -> None:
    """Train a student. task: `train`'s arguments."""
    options = {name: task[name] for name in ("plant", "scenario", "parameters", "weights")}
    plants = known_plants(d.plants, options, seed=task["seed"], quiet=quiet)
    policy = distil(d, PrivilegedPulse(), plants, options=options, seed=task["seed"], quiet=quiet)
    provenance = {"distillation": asdict(d), "seed": task["seed"]}
    save_policy(policy, folder, control_period=OnOff.default_period, provenance=provenance)


def _train_memoryless_into(folder: Path, h: Hyperparameters, **task: Any) -> None:
    """Train a policy without memory at the default rates and prices. task: `train`'s arguments."""
    usual = Hyperparameters()
    rates = {"learning_rate": usual.learning_rate, "breakdown_price": usual.breakdown_price}
    policy, _ = train(replace(h, **rates), folder=folder, **task)
    provenance = {"timesteps": task["timesteps"], "seed": task["seed"]}
    save_policy(policy, folder, control_period=OnOff.default_period, provenance=provenance)
