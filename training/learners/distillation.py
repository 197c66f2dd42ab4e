"""A policy with a memory learns to act as a controller that knows its plant, from measurements alone.

What a pulse controller with a table of the valve's own plant would do (controllers/privileged_pulse.py)
depends on that plant, so whoever imitates it from what an ECU measures has to find the plant out from
what the valve shows, and to remember it: "learning by cheating" (Chen et al., CoRL 2019). The student
drives more and more of the episodes and is told what the teacher would have done in each state that it
got into: DAgger (Ross, Gordon and Bagnell, AISTATS 2011). Then PPO goes on from there (ppo.py).

That teacher lets the valve rest. Where switching is so cheap that this does not pay, PPO trains a policy
without a memory first, and goes on from it with what the student remembers.
"""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn.functional import binary_cross_entropy_with_logits
from tqdm import tqdm

from controllers.base import Controller
from controllers.learned import GatedUnit, LearnedPolicy, holds_policy, load_policy
from controllers.privileged_pulse import PrivilegedPulse
from controllers.pulse_table import PulseTables
from epv_env.actions import OnOff
from epv_env.observation import LAYOUT
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant
from epv_env.plant.region import Region
from epv_env.reward import RewardWeights
from training.evaluation.rollout import begin_episodes, make_env, run_episodes
from training.evaluation.seeds import VALIDATION_SEED, distillation_seeds
from training.learners.checkpoint_selection import score
from training.learners.imitation import SLIPS
from training.learners.learning_log import TrainingLog
from training.learners.policy_files import save_policy
from training.learners.ppo import Hyperparameters, train

NAME = "PPO, recurrent"
STUDENT_FOLDER = "student"
MEMORYLESS_FOLDER = "memoryless"

GOING_ON = Hyperparameters(
    band_price=10.0, band_bar=0.32, breakdown_price=2.0, sharpness=3.0, ent_coef=0.0,
    learning_rate=1e-4, last_learning_rate=5e-6, n_steps=128, batch_size=8192, gae_lambda=0.98,
    first_validation=0.05,
)  # fmt: skip
"""PPO's, from a student on. One period more or less of a pulse is worth 200 mbar, so that exploring more
than the student doubts teaches nothing but caution; and who can keep within the band may pay more for
coming near its edge, and for a breakdown."""

BUSY = Hyperparameters(learning_rate=4e-4, breakdown_price=0.6, first_validation=0.05)
"""PPO's where a switching costs less than usual, from a policy without a memory on (`is_cheap`)."""


def is_cheap(weights: RewardWeights) -> bool:
    """Whether a switching costs less than usual: then another way of control than the student's pays."""
    return weights.switching < RewardWeights().switching


def going_on(weights: RewardWeights) -> Hyperparameters:
    """PPO's with a memory, at these prices."""
    return BUSY if is_cheap(weights) else GOING_ON


@dataclass(frozen=True, kw_only=True)
class Distillation:
    """What defines it."""

    memory: int = 32
    """Cells of the gated recurrent unit."""
    width: int = 64
    """Of the two hidden layers."""
    rounds: int = 32
    plants: int = 512
    """Drawn once: a teacher's table of a plant takes longer than the episodes on it."""
    episodes: int = 256
    """Of each round, side by side, on plants picked from those."""
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
    h: Hyperparameters,
    d: Distillation = FULL,
    *,
    folder: Path,
    resume: bool,
    student: Path | None = None,
    memoryless: Path | None = None,
    quiet: bool = False,
    **task: Any,
) -> tuple[LearnedPolicy, TrainingLog]:
    """Train a student, kept in a folder within `folder`, and go on from it with PPO.

    Where switching is cheap PPO goes on from a policy that it has trained without a memory, kept beside
    the student, and gives it the student's.

    student, memoryless: folders of those that are there already. task: `train`'s other arguments. An
    interruption loses the student if it is not finished, and no more of the rest than `train` does.
    """
    if student is None:
        student = folder / STUDENT_FOLDER
        if not (resume and holds_policy(student)):
            _distil_into(student, d, quiet=quiet, **task)
    begun = load_student(student, h)
    if is_cheap(task["weights"]):
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
    found = distil(d, PrivilegedPulse(), plants, options=options, seed=task["seed"], quiet=quiet)
    provenance = {"distillation": asdict(d), "seed": task["seed"]}
    save_policy(found, folder, control_period=OnOff.default_period, provenance=provenance)


def _train_memoryless_into(folder: Path, h: Hyperparameters, **task: Any) -> None:
    """Train a policy without a memory, as usual but for its size. task: `train`'s arguments."""
    usual = Hyperparameters()
    rates = {"learning_rate": usual.learning_rate, "breakdown_price": usual.breakdown_price}
    found, _ = train(replace(h, **rates), folder=folder, **task)
    provenance = {"timesteps": task["timesteps"], "seed": task["seed"]}
    save_policy(found, folder, control_period=OnOff.default_period, provenance=provenance)


def with_memory_of(student: LearnedPolicy, policy: LearnedPolicy) -> LearnedPolicy:
    """A policy without a memory, with the student's, which its layers do not heed yet.

    It acts as before until it learns more (Net2Net: Chen, Goodfellow and Shlens, ICLR 2016).
    """
    (weight, bias), *rest = policy.layers
    unheeded = np.zeros((len(weight), student.cells), dtype=weight.dtype)
    return replace(student, layers=[(np.concatenate([weight, unheeded], axis=1), bias), *rest])


def load_student(folder: Path, h: Hyperparameters = GOING_ON) -> LearnedPolicy:
    """A policy that PPO can go on from. Raises ValueError if it cannot, PolicyError if it is damaged."""
    student = load_policy(folder)
    widths = [len(bias) for _, bias in student.layers[:-1]]
    if student.cell is None or widths != [h.width, h.width]:
        raise ValueError(
            f"the policy in {folder} has {student.cells} cells and hidden layers of {widths}: PPO goes "
            f"on from one with a memory and layers of {[h.width, h.width]}, as `python "
            f"training/train_ppo.py --recurrent` writes into its folder `{STUDENT_FOLDER}`"
        )
    return student


def known_plants(count: int, options: dict[str, Any], *, seed: int, quiet: bool) -> list[Parameters]:
    """Plants drawn from the environment's region, for which the informed pulse has its tables ready."""
    plant: Plant = options["plant"]
    region, rng = Region.named(options["parameters"], plant.parameters), np.random.default_rng(seed)
    plants = [region.draw(rng) for _ in range(count)]
    for each in tqdm(plants, desc="tables", unit="plant", disable=quiet):
        PulseTables.of([each])
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
    """The best student that was validated.

    plants: of the lessons. options: of the environment. seed: of the training.
    """
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
        own = list(seeds[number * d.episodes : (number + 1) * d.episodes])
        met = [dict(plants[k]) for k in rng.choice(len(plants), d.episodes)]
        driven = rng.random(d.episodes) < 1 - number / d.handover
        lessons.append(_lesson(policy_of(student), teacher, own, met, driven, d.periods, options, rng))
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


def _lesson(
    student: LearnedPolicy,
    teacher: Controller,
    seeds: list[int],
    plants: list[dict[str, float]],
    driven: NDArray,
    periods: int,
    options: dict[str, Any],
    rng: np.random.Generator,
) -> tuple[torch.Tensor, torch.Tensor]:
    """What the valves showed (n, periods, entries), and what the teacher would have done (n, periods).

    driven: (n,) which episodes the teacher drives; a few actions are executed wrongly.
    """
    env = make_env(student, len(seeds), **options)
    observation = begin_episodes(env, teacher, seeds, {"parameters": plants})
    student.reset(len(seeds))
    seen, wanted = [], []
    for _ in range(periods):
        right = teacher.act(observation)
        action = np.where(driven, right, student.act(observation))
        slips = rng.random(len(seeds)) < SLIPS
        seen.append(observation)
        wanted.append(right)
        done = np.where(slips, 1 - action, action)
        # Through the task: a bad student's circuit may empty, and the others' episodes go on.
        observation = env.task.step(*env.action.decode(done)).observation
    env.close()
    shown = np.array(seen).swapaxes(0, 1).copy()
    return torch.as_tensor(shown), torch.as_tensor(np.array(wanted, dtype=np.float32).T.copy())


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
