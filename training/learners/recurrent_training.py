"""Training of a recurrent policy: distillation of a privileged teacher, then PPO.

The teacher lets the valve rest. Where switching is so cheap that resting does not pay, PPO trains a
policy without memory first, and goes on from this policy with the student's recurrent unit.
"""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from controllers.learned import LearnedPolicy, holds_policy, load_policy
from controllers.policy_contract import read_contract
from controllers.privileged_pulse import WITH_RESERVE, PrivilegedPulse
from epv_env.actions import OnOff
from training.learners.distillation import Distillation, distil
from training.learners.hyperparameters import Hyperparameters, switching_is_cheap
from training.learners.learning_log import TrainingLog
from training.learners.lessons import known_plants
from training.learners.policy_files import save_policy
from training.learners.ppo import train
from training.learners.run_folder import MEMORYLESS_FOLDER, STUDENT_FOLDER
from training.learners.run_state import RunError, as_json, new_run
from training.learners.student import load_student, with_memory_of


def train_recurrent(
    h: Hyperparameters,
    d: Distillation,
    *,
    folder: Path,
    resume: bool,
    student: Path | None = None,
    memoryless: Path | None = None,
    run: str | None = None,
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
        run: identity of the run; None: that of the folder's student, or a new one.
        quiet: no progress bars.
        task: `train`'s other arguments.

    Raises:
        RunError: the folder's student or checkpoint is of another run, or damaged.
    """
    if student is None:
        student = folder / STUDENT_FOLDER
        if resume and holds_policy(student):
            run = _run_of_student(student, run, d, seed=task["seed"])
        else:
            run = run or new_run()
            _distil_into(student, d, run=run, quiet=quiet, **task)
    begun = load_student(student, h)
    if switching_is_cheap(task["weights"]):
        if memoryless is None:
            memoryless = folder / MEMORYLESS_FOLDER
            if not (resume and holds_policy(memoryless)):
                _train_memoryless_into(memoryless, h, run=run, resume=resume, quiet=quiet, **task)
        begun = with_memory_of(begun, load_policy(memoryless))
    return train(h, folder=folder, student=begun, run=run, resume=resume, quiet=quiet, **task)


def _run_of_student(folder: Path, run: str | None, d: Distillation, *, seed: int) -> str:
    """The run that a finished student belongs to. Raises RunError if it is another or other one."""
    provenance = read_contract(folder).provenance
    wanted = {"run": run or provenance.get("run"), **_distilled_from(d, seed)}
    for name, value in as_json(wanted).items():
        if provenance.get(name) != value:
            raise RunError(
                f"the student in {folder} was trained with another {name}: give --force to begin anew, "
                "or choose another --out"
            )
    return wanted["run"] or new_run()


def _distilled_from(d: Distillation, seed: int) -> dict[str, Any]:
    """What a student's provenance says of its training."""
    return {"distillation": asdict(d), "seed": seed}


def _distil_into(folder: Path, d: Distillation, *, run: str, quiet: bool, **task: Any) -> None:
    """Train a student. task: `train`'s arguments."""
    options = {name: task[name] for name in ("plant", "scenario", "parameters", "weights")}
    plants = known_plants(d.plants, options, seed=task["seed"], quiet=quiet)
    teacher = PrivilegedPulse(**WITH_RESERVE) if d.reserve else PrivilegedPulse()
    policy = distil(d, teacher, plants, options=options, seed=task["seed"], quiet=quiet)
    provenance = {"run": run, **_distilled_from(d, task["seed"])}
    save_policy(policy, folder, control_period=OnOff.default_period, provenance=provenance)


def _train_memoryless_into(folder: Path, h: Hyperparameters, **task: Any) -> None:
    """Train a policy without memory at the default rates and prices. task: `train`'s arguments."""
    usual = Hyperparameters()
    rates = {"learning_rate": usual.learning_rate, "breakdown_price": usual.breakdown_price}
    policy, log = train(replace(h, **rates), folder=folder, **task)
    provenance = {"run": log.run.run, "timesteps": task["timesteps"], "seed": task["seed"]}
    save_policy(policy, folder, control_period=OnOff.default_period, provenance=provenance)
