"""Policy distillation: a recurrent student imitates a privileged teacher, from measurements alone.

The teacher, a pulse controller with a table of the valve's own plant (controllers/privileged_pulse.py),
acts on plant parameters that no ECU measures. The student has to identify the plant from what the valve
shows, and to remember it: "learning by cheating" (Chen et al., CoRL 2019). The student drives more and
more of the episodes and is told what the teacher would have done in each state that it got into: DAgger
(Ross, Gordon and Bagnell, AISTATS 2011). Then PPO goes on from there (recurrent_training.py).
"""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn.functional import binary_cross_entropy_with_logits
from tqdm import tqdm

from controllers.base import Controller
from controllers.learned import LearnedPolicy
from controllers.pulse_simulation import pulse_tables
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant
from epv_env.plant.region import Region
from training.evaluation.rollout import begin_episodes, make_env
from training.evaluation.seeds import distillation_seeds
from training.learners.imitation import with_action_noise
from training.learners.schedules import linear
from training.learners.student import Student, policy_of
from training.learners.validation import ValidationSettings, score, validate

Lesson = tuple[torch.Tensor, torch.Tensor]
"""Observations (n, periods, entries), and the teacher's actions (n, periods)."""


@dataclass(frozen=True, kw_only=True)
class Distillation:
    """What defines a distillation."""

    memory: int = 32
    """Cells of the gated recurrent unit."""
    width: int = 64
    """Units of each of the two hidden layers."""
    rounds: int = 32
    """Rounds of episodes and learning."""
    plants: int = 512
    """Number of plants, drawn once: the table of a plant takes longer than the episodes on it."""
    episodes: int = 256
    """Episodes of each round, side by side, on plants picked from those."""
    periods: int = 700
    """Length of an episode [control periods] (3.5 s)."""
    handover: int = 4
    """Rounds until the student drives every episode; the teacher's share falls linearly."""
    kept: int = 8
    """Number of latest rounds whose episodes are learned from."""
    steps: int = 12
    """Gradient steps of each round."""
    batch: int = 128
    """Episodes of a gradient step."""
    learning_rate: float = 2e-3
    """Adam's step size at the start; it falls linearly to `last_learning_rate`."""
    last_learning_rate: float = 5e-5
    """Adam's step size at the end."""
    validations: int = 6
    """Number of the last rounds after which the student is validated; the best one is kept."""
    validation_episodes: int = 512
    """Episodes of a validation."""
    validation_duration: float = 6.0
    """Length of a validation episode [s]."""


def known_plants(count: int, options: dict[str, Any], *, seed: int, quiet: bool) -> list[Parameters]:
    """Plants drawn from the environment's region, with the teacher's tables of them already made.

    Args:
        count: number of plants.
        options: of the environment: its plant and its region.
        seed: of the draws.
        quiet: no progress bar.
    """
    plant: Plant = options["plant"]
    region, rng = Region.named(options["parameters"], plant.parameters), np.random.default_rng(seed)
    plants = [region.draw(rng) for _ in range(count)]
    for each in tqdm(plants, desc="tables", unit="plant", disable=quiet):
        pulse_tables([each])
    return plants


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
    rng = np.random.default_rng(seed)
    student = Student(memory=d.memory, width=d.width)
    optimiser = torch.optim.Adam(student.parameters(), lr=d.learning_rate)
    seeds = distillation_seeds(seed, d.rounds * d.episodes)
    validation = ValidationSettings(episodes=d.validation_episodes, duration=d.validation_duration)
    lessons: deque[Lesson] = deque(maxlen=d.kept)
    best, chosen = -np.inf, policy_of(student)
    progress = tqdm(range(d.rounds), desc="memory", unit="round", disable=quiet)
    for number in progress:
        own = list(seeds[number * d.episodes : (number + 1) * d.episodes])
        met = [dict(plants[k]) for k in rng.choice(len(plants), d.episodes)]
        driven = rng.random(d.episodes) < 1 - number / d.handover
        lessons.append(_lesson(policy_of(student), teacher, own, met, driven, d.periods, options, rng))
        for group in optimiser.param_groups:
            group["lr"] = linear(d.learning_rate, d.last_learning_rate, 1 - number / d.rounds)
        loss = _learn(student, optimiser, lessons, d)
        progress.set_postfix(cross_entropy=f"{loss:.3f}")
        if number >= d.rounds - d.validations:
            policy = policy_of(student)
            if (reached := score(validate(policy, validation, options))) > best:
                best, chosen = reached, policy
    return chosen


def _lesson(
    student: LearnedPolicy,
    teacher: Controller,
    seeds: list[int],
    plants: list[dict[str, float]],
    driven: NDArray,
    periods: int,
    options: dict[str, Any],
    rng: np.random.Generator,
) -> Lesson:
    """Episodes of n valves with action noise.

    driven: (n,) bool, the episodes that the teacher drives. The student drives the others.
    """
    env = make_env(student, len(seeds), **options)
    observation = begin_episodes(env, teacher, seeds, {"parameters": plants})
    student.reset(len(seeds))
    observations, wanted = [], []
    for _ in range(periods):
        right = teacher.act(observation)
        action = np.where(driven, right, student.act(observation))
        observations.append(observation)
        wanted.append(right)
        executed = with_action_noise(action, rng)
        # Through the task: a bad student's circuit may empty, and the others' episodes go on.
        observation = env.task.step(*env.action.decode(executed)).observation
    env.close()
    by_episode = np.array(observations).swapaxes(0, 1).copy()
    return torch.as_tensor(by_episode), torch.as_tensor(np.array(wanted, dtype=np.float32).T.copy())


def _learn(
    student: Student, optimiser: torch.optim.Optimizer, lessons: deque[Lesson], d: Distillation
) -> float:
    """Gradient steps on episodes drawn from all lessons; returns the mean cross-entropy."""
    observations, wanted = (torch.cat(part) for part in zip(*lessons, strict=True))
    losses = []
    for _ in range(d.steps):
        rows = torch.randint(len(wanted), (d.batch,))
        loss = binary_cross_entropy_with_logits(student(observations[rows]), wanted[rows])
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(student.parameters(), 1.0)
        optimiser.step()
        losses.append(float(loss.detach()))
    return float(np.mean(losses))
