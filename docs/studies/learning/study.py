"""What learning adds: the same algorithms on the readings alone and with what is learnt of a valve.

    python -m docs.studies.learning.study --seeds 3

writes learning.csv and the page's table. Trainings that are finished are kept in runs/learning/CODE.
"""

import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
import torch
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from controllers.base import Controller
from controllers.knowledge import LearntObservation, ValveKnowledge
from controllers.policy import load_policy
from docs.studies.common import PAGE, fill, study_options, study_parser, table
from epv_env.common.command_line import fail_clearly
from epv_env.common.files import Journal, write_text
from epv_env.common.options import COUNT
from epv_env.plant.plantfile import Plant, load_plant
from epv_env.reward import RewardWeights
from training.evaluation.batches import run_jobs
from training.evaluation.named import named_controllers
from training.evaluation.rollout import run_episodes
from training.evaluation.scenarios import RANDOM
from training.evaluation.seeds import EVALUATION_SEED
from training.learners.environment import make_training_env
from training.learners.ppo import Task, make_model, train
from training.studies import comparison

FOLDER = Path(__file__).parent
TIMESTEPS, QUICK_TIMESTEPS = 10_000_000, 65_536
"""Steps of every training: those of `epv train`, and under --quick."""
EPISODES, QUICK_EPISODES, DURATION = 1024, 8, 10.0
"""Episodes on which all are judged, under --quick, and their length [s]."""
PLANTS = "sensitive_ten_percent"
"""Region that the valves are drawn from."""
DQN_SETTINGS: dict[str, Any] = {
    "learning_rate": 1e-3, "buffer_size": 1_000_000, "learning_starts": 50_000, "batch_size": 4096,
    "train_freq": 1, "gradient_steps": 2, "target_update_interval": 20_000, "gamma": 0.998,
    "exploration_fraction": 0.3, "exploration_final_eps": 0.01,
}  # fmt: skip
"""Two gradient steps for each step of all environments."""
REFERENCES = ("extrapolating hysteresis", "adaptive pulse", "adaptive pulse with rules")
"""Controllers that learn from no episode."""
ORACLE = "informed pulse"
"""Knows each valve's parameters."""
COLUMNS = {
    "left_percent": ("violation rate [%]", "{:.3g}"),
    "mean_return": ("return", "{:.0f}"),
    "rms_error_mbar": ("rms error [mbar]", "{:.0f}"),
    "C2_event_breakdown_mbar": ("pressure dip [mbar]", "{:.0f}"),
    "switchings_per_s": ("switchings [1/s]", "{:.1f}"),
}
"""Columns of the page's table: heading and format."""


class Greedy:
    """A trained model as a controller: its most probable, or most valuable, action."""

    environment = "EPValve-v0"

    def __init__(self, name: str, model: BaseAlgorithm, knowledge: ValveKnowledge | None):
        """knowledge: gives the learnt quantities that the model reads; None: it reads none."""
        self.name, self.model, self.knowledge = name, model, knowledge

    def reset(self, n: int) -> None:
        """Forget the valves; n episodes begin."""
        if self.knowledge is not None:
            self.knowledge.reset(n)

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve's readings (n, entries), (n,)."""
        seen = observations if self.knowledge is None else self.knowledge.observe(observations)
        return self.model.predict(seen, deterministic=True)[0]


def readings_alone(env: VectorEnv) -> VectorEnv:
    """The environment as Gymnasium makes it."""
    return env


def make_ppo(env: VecEnv, seed: int) -> PPO:
    """stable-baselines3's PPO with the settings of `epv train`."""
    return make_model(env, seed=seed, policy="MlpPolicy")


def make_dqn(env: VecEnv, seed: int) -> DQN:
    """stable-baselines3's DQN."""
    return DQN(
        "MlpPolicy", env, policy_kwargs={"net_arch": [64, 64]}, seed=seed, device="cpu", **DQN_SETTINGS
    )


LEARNERS: dict[str, tuple[Callable[[VecEnv, int], BaseAlgorithm], Callable[[VectorEnv], VectorEnv]]] = {
    "DQN on the readings": (make_dqn, readings_alone),
    "PPO on the readings": (make_ppo, readings_alone),
    "PPO with the valve learner": (make_ppo, LearntObservation),
}
"""Algorithm, and what it sees."""
WHOLE = "PPO with learner, prior action and rules"
"""What `epv train` does."""


def learned(name: str, seed: int, timesteps: int, plant: Plant) -> Controller:
    """One of LEARNERS after its training."""
    torch.set_num_threads(1)
    make, wrap = LEARNERS[name]
    env = make_training_env(plant=plant, weights=RewardWeights(), wrap=wrap)
    model = make(env, seed).learn(timesteps)
    return Greedy(name, model, ValveKnowledge(plant) if wrap is LearntObservation else None)


def reference(name: str, plant: Plant) -> Controller:
    """A controller that learns from no episode."""
    return named_controllers([name], plant)[0][name]


def whole(folder: Path, seed: int, timesteps: int, plant: Plant) -> Controller:
    """The policy that `epv train` makes."""
    train(Task(plant=plant), folder / f"seed-{seed}", timesteps=timesteps, seed=seed, resume=True)
    return load_policy(folder / f"seed-{seed}", plant)


def judged(make: Callable[[], Controller], episodes: int, plant: Plant) -> dict[str, float]:
    """Figures of a controller on the episodes that all meet."""
    seeds = range(EVALUATION_SEED, EVALUATION_SEED + episodes)
    options = {"plant": plant, "parameters": PLANTS}
    found = run_episodes(make(), seeds=seeds, duration=DURATION, options=options)
    row = comparison.rows({(PLANTS, RANDOM, ""): found}).iloc[0]
    return {column: float(row[column]) for column in COLUMNS}


def page_table(rows: pd.DataFrame) -> str:
    """A line for each controller: the mean over its seeds, and the least and the greatest value."""
    lines = []
    for name, own in rows.groupby("controller", sort=False):
        cells = []
        for column, (_, form) in COLUMNS.items():
            mean, low, high = (form.format(v) for v in own[column].agg(["mean", "min", "max"]))
            cells.append(mean if len(own) == 1 else f"{mean} ({low} to {high})")
        lines.append([str(name), "–" if name in (*REFERENCES, ORACLE) else str(len(own)), *cells])
    return table(["controller", "seeds", *(heading for heading, _ in COLUMNS.values())], lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    parser = study_parser(__doc__ or "", FOLDER)
    parser.add_argument("--seeds", type=COUNT, default=10, help="trainings of each algorithm")
    options = study_options(parser, arguments)
    quick, plant = options.quick, load_plant(None)
    timesteps, episodes = (QUICK_TIMESTEPS, QUICK_EPISODES) if quick else (TIMESTEPS, EPISODES)
    options.work.mkdir(parents=True, exist_ok=True)
    seeds = range(1 if quick else options.seeds)
    makers = {(name, 0): partial(reference, name, plant) for name in REFERENCES}
    makers |= {(n, s): partial(learned, n, s, timesteps, plant) for n in LEARNERS for s in seeds}
    makers |= {(WHOLE, seed): partial(whole, options.work, seed, timesteps, plant) for seed in seeds}
    if not quick:
        makers[ORACLE, 0] = partial(reference, ORACLE, plant)
    jobs = {f"{n}, {seed}": partial(judged, make, episodes, plant) for (n, seed), make in makers.items()}
    journal = Journal(options.work / "learning.jsonl", {"timesteps": timesteps, "episodes": episodes})
    found = run_jobs(jobs, journal=journal, workers=None, what="learning")
    rows = pd.DataFrame(
        {"controller": name, "seed": seed, **row}
        for (name, seed), row in zip(makers, found, strict=True)
    )
    write_text(options.out / "learning.csv", rows.to_csv(index=False, float_format="%.6g"))
    fill(options.out / PAGE, {"learning": page_table(rows)})
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
