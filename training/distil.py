"""A policy with a memory learns to act as an informed one does, from what an ECU measures alone.

The informed policy (training/informed.py) knows its plant. What it would do depends on that, so whoever
imitates it from measurements has to find the plant out from what they show, and to remember it. The
student drives more and more of the episodes and is told what the teacher would have done in each state
that it got into: DAgger (Ross, Gordon and Bagnell, AISTATS 2011).
"""

from collections import deque
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn.functional import binary_cross_entropy_with_logits
from tqdm import tqdm

from controllers.learned import GatedUnit, LearnedPolicy
from epv_env.observation import INDEX, LAYOUT
from training.imitation import SLIPS
from training.informed import Informed
from training.learning_log import TrainingLog
from training.ppo import Hyperparameters, informed_policy, train
from training.rollout import begin_episodes, make_env, run_episodes
from training.seeds import VALIDATION_SEED, distillation_seeds
from training.selection import score

NAME = "PPO, recurrent"
INFORMED_FOLDER = "informed"

INFORMED = Hyperparameters(band_price=10.0, n_epochs=5)
"""Whoever knows the plant can stay within the band: leaving it may cost more than it does for a policy
that has to guess. What it starts from is good, so it may learn more from each step."""


@dataclass(frozen=True, kw_only=True)
class Distillation:
    """What defines it."""

    memory: int = 32
    """Cells of the gated recurrent unit."""
    width: int = 64
    """Of the two hidden layers."""
    rounds: int = 32
    episodes: int = 256
    """Of each round, side by side."""
    periods: int = 700
    """Control periods of an episode (3.5 s)."""
    handover: int = 4
    """Rounds until the student drives every episode; the teacher's share falls linearly."""
    kept: int = 8
    """Rounds whose episodes are learned from, the last ones."""
    epochs: int = 3
    """Passes over them in each round."""
    batch: int = 64
    """Episodes of a gradient step."""
    learning_rate: float = 2e-3
    """At the start; it falls linearly to `last_learning_rate`."""
    last_learning_rate: float = 5e-5
    validations: int = 6
    """After how many of the last rounds the student is validated; the best one is kept."""
    validation_episodes: int = 512
    validation_duration: float = 6.0
    """Length of a validation episode [s]."""
    trims: tuple[float, ...] = (0.0, 0.01, 0.02, 0.03, 0.04, 0.05)
    """By how much p2 may be taken for higher than it is measured [bar]: what `trim` chooses from."""
    trim_episodes: int = 2048
    trim_duration: float = 10.0
    """Length of an episode that a trim is chosen on [s]."""


FULL = Distillation()


class Student(torch.nn.Module):
    """Observations (episodes, periods, entries) in, log odds of energising the coil out."""

    def __init__(self, d: Distillation):
        super().__init__()
        entries = len(LAYOUT)
        self.memory = torch.nn.GRU(entries, d.memory, batch_first=True)
        self.layers = torch.nn.Sequential(
            torch.nn.Linear(entries + d.memory, d.width), torch.nn.Tanh(),
            torch.nn.Linear(d.width, d.width), torch.nn.Tanh(),
            torch.nn.Linear(d.width, 1),
        )  # fmt: skip

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        remembered, _ = self.memory(observations)
        return self.layers(torch.cat([observations, remembered], dim=-1))[..., 0]


def policy_of(student: Student) -> LearnedPolicy:
    """The student's greedy policy, a copy of its weights."""
    arrays = {name: tensor.numpy().copy() for name, tensor in student.state_dict().items()}
    cell = GatedUnit(
        weight_input=arrays["memory.weight_ih_l0"],
        weight_memory=arrays["memory.weight_hh_l0"],
        bias_input=arrays["memory.bias_ih_l0"],
        bias_memory=arrays["memory.bias_hh_l0"],
    )
    layers = [(arrays[f"layers.{k}.weight"], arrays[f"layers.{k}.bias"]) for k in (0, 2, 4)]
    weight, bias = layers[-1]  # the log odds of one action are the logit of the one, 0 of the other
    layers[-1] = np.concatenate([0 * weight, weight]), np.concatenate([0 * bias, bias])
    return LearnedPolicy(layers=layers, cell=cell, name=NAME)


def train_recurrent(
    h: Hyperparameters = INFORMED,
    d: Distillation = FULL,
    *,
    folder: Path,
    resume: bool,
    quiet: bool = False,
    **task: Any,
) -> tuple[LearnedPolicy, TrainingLog]:
    """Train an informed model in a folder within `folder`, then the policy that imitates it.

    task: `train`'s other arguments. An interruption loses no more of the first than `train` does, but
    the second begins anew.
    """
    informed = folder / INFORMED_FOLDER
    model, log = train(h, folder=informed, informed=True, resume=resume, quiet=quiet, **task)
    names = ("plant", "scenario", "parameters", "weights")
    options = {name: task[name] for name in names}
    student = distil(d, informed_policy(model), options=options, seed=task["seed"], quiet=quiet)
    return trim(d, student, options=options), log


def distil(
    d: Distillation, teacher: Informed, *, options: dict[str, Any], seed: int, quiet: bool = False
) -> LearnedPolicy:
    """The best student that was validated. options: of the environment; seed: of the training."""
    torch.set_num_threads(1)  # sums do not depend on the machine's cores
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    student = Student(d)
    optimiser = torch.optim.Adam(student.parameters(), lr=d.learning_rate)
    seeds = distillation_seeds(seed, d.rounds * d.episodes)
    lessons: deque[tuple[torch.Tensor, torch.Tensor]] = deque(maxlen=d.kept)
    best, chosen = -np.inf, policy_of(student)
    progress = tqdm(range(d.rounds), desc="memory", unit="round", disable=quiet)
    for number in progress:
        share = max(0.0, 1 - number / d.handover)
        own = list(seeds[number * d.episodes : (number + 1) * d.episodes])
        driven = rng.random(d.episodes) < share
        lessons.append(_lesson(policy_of(student), teacher, own, driven, d.periods, options, rng))
        left = 1 - number / d.rounds
        for group in optimiser.param_groups:
            group["lr"] = d.last_learning_rate + left * (d.learning_rate - d.last_learning_rate)
        loss = _learn(student, optimiser, lessons, d)
        progress.set_postfix(cross_entropy=f"{loss:.3f}")
        if number >= d.rounds - d.validations:
            policy = policy_of(student)
            if (found := _validated(d, policy, options)) > best:
                best, chosen = found, policy
    return chosen


def trim(d: Distillation, policy: LearnedPolicy, *, options: dict[str, Any]) -> LearnedPolicy:
    """The policy with the trim with which it leaves the band least often on validation episodes.

    An imitation errs where it is unsure, and more to one side of the band than to the other. Equals are
    decided by the mean return.
    """
    seeds = list(range(VALIDATION_SEED, VALIDATION_SEED + d.trim_episodes))
    found = []
    for bar in d.trims:
        candidate = trimmed(policy, bar)
        metrics, _ = run_episodes(candidate, seeds=seeds, duration=d.trim_duration, options=options)
        found.append((int((~metrics.stayed).sum()), -float(metrics.episode_return.mean()), candidate))
    return min(found, key=lambda each: each[:2])[2]


def trimmed(policy: LearnedPolicy, bar: float) -> LearnedPolicy:
    """A policy with a memory that acts as this one would if p2 were measured higher by so much [bar]."""
    assert policy.cell is not None, "only a policy with a memory is trimmed"
    row = INDEX["p2_error"]
    change = np.float32(bar / LAYOUT[row].scale)
    unit = policy.cell
    cell = replace(unit, bias_input=unit.bias_input + change * unit.weight_input[:, row])
    (weight, bias), *rest = policy.layers
    return replace(policy, layers=[(weight, bias + change * weight[:, row]), *rest], cell=cell)


def _lesson(
    student: LearnedPolicy,
    teacher: Informed,
    seeds: list[int],
    driven: NDArray,
    periods: int,
    options: dict[str, Any],
    rng: np.random.Generator,
) -> tuple[torch.Tensor, torch.Tensor]:
    """What the valves showed (n, periods, entries), and how likely the teacher energises (n, periods).

    driven: (n,) which episodes the teacher drives; a few actions are executed wrongly.
    """
    env = make_env(student, len(seeds), **options)
    observation = begin_episodes(env, teacher, seeds)
    student.reset(len(seeds))
    seen, wanted = [], []
    for _ in range(periods):
        logits = teacher.logits(observation)
        odds = logits[:, 1] - logits[:, 0]
        action = np.where(driven, odds > 0, student.act(observation)).astype(int)
        slips = rng.random(len(seeds)) < SLIPS
        seen.append(observation)
        wanted.append(odds)
        observation, *_ = env.step(np.where(slips, 1 - action, action))
    env.close()
    likely = torch.sigmoid(torch.as_tensor(np.array(wanted).T))
    return torch.as_tensor(np.array(seen).swapaxes(0, 1).copy()), likely


def _learn(
    student: Student,
    optimiser: torch.optim.Optimizer,
    lessons: deque[tuple[torch.Tensor, torch.Tensor]],
    d: Distillation,
) -> float:
    """Pass over the lessons; returns the mean cross-entropy."""
    losses = []
    for _ in range(d.epochs):
        batches = [
            (number, rows)
            for number in range(len(lessons))
            for rows in torch.randperm(d.episodes).split(d.batch)
        ]
        for k in torch.randperm(len(batches)):
            number, rows = batches[k]
            seen, wanted = lessons[number]
            loss = binary_cross_entropy_with_logits(student(seen[rows]), wanted[rows])
            optimiser.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(student.parameters(), 1.0)
            optimiser.step()
            losses.append(float(loss.detach()))
    return float(np.mean(losses))


def _validated(d: Distillation, policy: LearnedPolicy, options: dict[str, Any]) -> float:
    """The policy's score on the validation's episodes."""
    seeds = list(range(VALIDATION_SEED, VALIDATION_SEED + d.validation_episodes))
    metrics, _ = run_episodes(policy, seeds=seeds, duration=d.validation_duration, options=options)
    return score(metrics)
