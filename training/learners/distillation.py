"""Policy distillation: a recurrent student imitates a privileged teacher, from measurements alone.

The teacher, a pulse controller with a table of the valve's own plant (controllers/privileged_pulse.py),
acts on plant parameters that no ECU measures. The student has to identify the plant from what the valve
shows, and to remember it: "learning by cheating" (Chen et al., CoRL 2019). The student drives more and
more of the episodes and is told what the teacher would have done in each state that it got into: DAgger
(Ross, Gordon and Bagnell, AISTATS 2011). Then PPO goes on from there (recurrent_training.py).
"""

from collections import deque
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch.nn.functional import binary_cross_entropy_with_logits
from tqdm import tqdm

from controllers.base import Controller
from controllers.learned import LearnedPolicy
from training.learners.lessons import Lesson, Lessons, LessonSettings
from training.learners.schedules import linear
from training.learners.student import Student, policy_of
from training.learners.validation import ValidationSettings, score, validate


@dataclass(frozen=True, kw_only=True)
class Distillation(LessonSettings):
    """What defines a distillation: its episodes, and how the student learns from them."""

    reserve: bool = False
    """Whether the teacher holds p2 higher where a valve is slow (controllers/reserve.py)."""
    memory: int = 32
    """Cells of the gated recurrent unit."""
    width: int = 64
    """Units of each of the two hidden layers."""
    kept: int = 4
    """Number of latest rounds whose episodes are learned from."""
    steps: int = 72
    """Gradient steps of each round."""
    batch: int = 128
    """Windows of a gradient step."""
    learning_rate: float = 2e-3
    """Adam's step size at the start; it falls linearly to `last_learning_rate`."""
    last_learning_rate: float = 5e-5
    """Adam's step size at the end."""
    validations: int = 3
    """Number of the last rounds after which the student is validated; the best one is kept."""
    validation_episodes: int = 512
    """Episodes of a validation."""
    validation_duration: float = 6.0
    """Length of a validation episode [s]."""


FOR_END_TO_END = Distillation(reserve=True)
"""For a student whose recurrent unit learns on with PPO."""


def distil(
    d: Distillation,
    teacher: Controller,
    plants: Sequence[Mapping[str, float]],
    *,
    options: dict[str, Any],
    seed: int,
    quiet: bool = False,
) -> LearnedPolicy:
    """The best validated student.

    Args:
        d: what defines the distillation.
        teacher: whose decisions the student learns.
        plants: parameters by symbol of the plants that episodes run on.
        options: of the environment.
        seed: of the training.
        quiet: no progress bar.
    """
    torch.set_num_threads(1)  # sums do not depend on the machine's cores
    torch.manual_seed(seed)
    student = Student(memory=d.memory, width=d.width)
    optimiser = torch.optim.Adam(student.parameters(), lr=d.learning_rate, fused=True)
    validation = ValidationSettings(episodes=d.validation_episodes, duration=d.validation_duration)
    ahead = Lessons(d, teacher, plants, options, seed)
    lessons: deque[Lesson] = deque(maxlen=d.kept)
    best, chosen = -np.inf, policy_of(student)
    progress = tqdm(range(d.rounds), desc="memory", unit="round", disable=quiet)
    with ThreadPoolExecutor(1) as pool:  # torch and the plant run outside of Python's lock
        upcoming = pool.submit(ahead.give, 0, policy_of(student))
        for number in progress:
            lessons.append(upcoming.result())
            if number + 1 < d.rounds:
                upcoming = pool.submit(ahead.give, number + 1, policy_of(student))
            for group in optimiser.param_groups:
                group["lr"] = linear(d.learning_rate, d.last_learning_rate, 1 - number / d.rounds)
            loss = _learn(student, optimiser, lessons, d)
            progress.set_postfix(cross_entropy=f"{loss:.3f}")
            if number >= d.rounds - d.validations:
                policy = policy_of(student)
                if (reached := score(validate(policy, validation, options))) > best:
                    best, chosen = reached, policy
    return chosen


def _learn(
    student: Student, optimiser: torch.optim.Optimizer, lessons: deque[Lesson], d: Distillation
) -> float:
    """Gradient steps on windows drawn from all lessons; returns the mean cross-entropy."""
    observations, wanted, states = (torch.cat(part) for part in zip(*lessons, strict=True))
    losses = []
    for _ in range(d.steps):
        rows = torch.randint(len(wanted), (d.batch,))
        logits = student(observations[rows], states[rows])
        loss = binary_cross_entropy_with_logits(logits, wanted[rows])
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(student.parameters(), 1.0)
        optimiser.step()
        losses.append(float(loss.detach()))
    return float(np.mean(losses))
