"""Lessons of a distillation: what a student meets in its episodes, and what its teacher would do."""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from tqdm import tqdm

from controllers.base import Controller
from controllers.learned import LearnedPolicy
from controllers.pulse_simulation import pulse_tables
from epv_env.conditions import Conditions
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant
from epv_env.plant.region import Region
from training.evaluation.rollout import begin_episodes, make_env
from training.evaluation.seeds import distillation_seeds
from training.learners.imitation import with_action_noise

Lesson = tuple[torch.Tensor, torch.Tensor, torch.Tensor]
"""Windows of a round's episodes: observations (windows, periods, entries), the teacher's actions
(windows, periods), and the student's recurrent state before each window (windows, cells)."""

WORKERS = 2
"""Threads that make tables: compiled code, which runs outside of Python's lock."""


FIRST_FILLINGS = Conditions(far=0.2, vented=0.2, coil_off=0.1, starved=0.1, noisy=0.3, target_steps=0.2)
"""Starts that ordinary episodes lack. The teacher's tables are of valves without effects and delays;
these are left to PPO."""


@dataclass(frozen=True, kw_only=True)
class LessonSettings:
    """Episodes of a distillation."""

    rounds: int = 36
    """Rounds of episodes and learning. The episodes of a round run while the student learns from those
    before, so the student that drives them is one round old."""
    plants: int = 256
    """Number of plants, drawn once: the table of a plant takes longer than the episodes on it."""
    episodes: int = 256
    """Episodes of each round, side by side, on plants picked from those."""
    periods: int = 700
    """Length of an episode [control periods] (3.5 s)."""
    window: int = 100
    """Length of a window that is learned from [control periods], a divisor of `periods`. It begins with
    the recurrent state that the student had there, so the state reaches further back than gradients."""
    handover: int = 4
    """Rounds until the student drives every episode; the teacher's share falls linearly."""
    conditions: Conditions = FIRST_FILLINGS
    """What episodes may meet beyond the ordinary."""

    def __post_init__(self) -> None:
        if self.periods % self.window:
            raise ValueError(f"window = {self.window} does not divide periods = {self.periods}")


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
    with ThreadPoolExecutor(WORKERS) as pool:
        made = pool.map(lambda each: pulse_tables([each]), plants)
        for _ in tqdm(made, total=count, desc="tables", unit="plant", disable=quiet):
            pass
    return plants


class Lessons:
    """One lesson after the other."""

    def __init__(
        self,
        settings: LessonSettings,
        teacher: Controller,
        plants: Sequence[Mapping[str, float]],
        options: dict[str, Any],
        seed: int,
    ):
        """
        Args:
            settings: of the episodes.
            teacher: whose decisions the student learns.
            plants: parameters by symbol of the plants that episodes run on.
            options: of the environment.
            seed: of the training.
        """
        self._settings, self._teacher, self._plants, self._options = settings, teacher, plants, options
        self._seeds = distillation_seeds(seed, settings.rounds * settings.episodes)
        self._rng = np.random.default_rng(seed)

    def give(self, number: int, student: LearnedPolicy) -> Lesson:
        """The lesson of round `number`, rounds in their order: episodes of n valves with action noise.

        The teacher drives some of the first rounds' episodes, the student all others.
        """
        s, rng = self._settings, self._rng
        seeds = list(self._seeds[number * s.episodes : (number + 1) * s.episodes])
        plants = [dict(self._plants[k]) for k in rng.choice(len(self._plants), s.episodes)]
        driven = rng.random(s.episodes) < 1 - number / s.handover
        env = make_env(student, s.episodes, **self._options, conditions=s.conditions)
        observation = begin_episodes(env, self._teacher, seeds, {"parameters": plants})
        student.reset(s.episodes)
        observations, wanted, states = [], [], []
        for period in range(s.periods):
            if period % s.window == 0:
                states.append(student.memory)
            right = self._teacher.act(observation)
            action = np.where(driven, right, student.act(observation))
            observations.append(observation)
            wanted.append(right.astype(np.float32))
            executed = with_action_noise(action, rng)
            # Through the task: a bad student's circuit may empty, and the others' episodes go on.
            observation = env.task.step(*env.action.decode(executed)).observation
        env.close()
        before = torch.as_tensor(np.array(states).swapaxes(0, 1).reshape(-1, student.cells))
        return _windows(observations, s.window), _windows(wanted, s.window), before


def _windows(series: list[NDArray], length: int) -> torch.Tensor:
    """A series of arrays (episodes, ...) in windows of `length` periods, (windows, length, ...)."""
    whole = np.array(series).swapaxes(0, 1)
    return torch.as_tensor(whole.reshape(-1, length, *whole.shape[2:]))
