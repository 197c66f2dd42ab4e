"""Several trainings one after another; the policy that holds the band best is kept.

Seeds may train policies that differ in what matters most, how rarely they leave the band. Each is
validated on many episodes that nothing else uses. Some begin with an empty control chamber or have a
late coil. The lowest violation rate wins, then the return.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from controllers.policy import Policy, load_policy
from controllers.policy_files import holds_policy, policy_digest
from epv_env.common.files import Journal, write_text
from epv_env.plant.plantfile import plant_subject
from training.evaluation.batches import Batch, run_batches
from training.evaluation.metrics import EpisodeMetrics, violation_interval
from training.evaluation.scenarios import REFILL_TIME
from training.evaluation.seeds import SELECTION_SEED
from training.learners.environment import CONDITIONS as TRAINED_ON
from training.learners.ppo import Task, train

EPISODES = 30_000
"""On which each policy is validated."""
CONDITIONS = replace(TRAINED_ON, braking=0.0, target_steps=0.0)
"""Of these episodes. Empty control chambers and late coils are as frequent as in training. Steps of the
target are left out: they are up to half a bar, which alone reaches the end of the band."""
JOURNAL, TABLE = "seeds.jsonl", "seeds.csv"


def seed_folder(folder: Path, seed: int) -> Path:
    """Where the training of a seed lies within that of all."""
    return folder / f"seed-{seed}"


def train_seeds(
    task: Task, folder: Path, *, seeds: Sequence[int], episodes: int = EPISODES,
    duration: float = 10.0, **training: Any,
) -> pd.DataFrame:  # fmt: skip
    """Train each seed in a folder of its own and validate it, but for what has been done already.

    Args:
        task: what the policies are for.
        folder: of all seeds; the table is written into it after each.
        seeds: of the trainings.
        episodes: of each validation.
        duration: of one of them [s].
        training: further arguments of `train`.

    Returns:
        A row for each seed, the best one first.
    """
    folder.mkdir(parents=True, exist_ok=True)
    about = {name: repr(value) for name, value in vars(task).items() if name != "plant"}
    about |= {"episodes": episodes, "duration": duration, "conditions": repr(CONDITIONS)}
    subject = {**plant_subject(task.plant), **about}
    journal, table = Journal(folder / JOURNAL, subject), pd.DataFrame()
    for seed in seeds:
        own = seed_folder(folder, seed)
        if not holds_policy(own):
            train(task, own, seed=seed, resume=True, **training)
        name = f"seed {seed}, {policy_digest(own)}"
        if name not in journal:
            journal.add(name, figures(validated(load_policy(own, task.plant), task, episodes, duration)))
        row = pd.DataFrame([{"seed": seed, **journal[name]}])
        table = pd.concat([table, row]).sort_values(
            ["violation_rate", "return"], ascending=[True, False], kind="stable"
        )
        write_text(folder / TABLE, table.to_csv(index=False))
    return table


def validated(policy: Policy, task: Task, episodes: int, duration: float) -> EpisodeMetrics:
    """Figures of the episodes that policies are chosen by."""
    options = {**vars(task), "conditions": CONDITIONS, "settling_time": REFILL_TIME}
    batch = Batch(
        name="selection", controller="PPO", first_seed=SELECTION_SEED, episodes=episodes,
        duration=duration, options=options,
    )  # fmt: skip
    return run_batches([batch], {"PPO": policy}, workers=None, what="validation")[0]


def figures(metrics: EpisodeMetrics) -> dict[str, float]:
    """A seed's row: violations with the exact 95 % interval of their rate, return, rms, switchings."""
    low, high = violation_interval(metrics.stayed)
    return {
        "episodes": len(metrics),
        "violations": int((~metrics.stayed).sum()),
        "violation_rate": float((~metrics.stayed).mean()),
        "rate_low": low,
        "rate_high": high,
        "return": float(metrics.episode_return.mean()),
        "rms_error_bar": float((metrics.rms_bar**2).mean() ** 0.5),
        "switchings_per_s": float(metrics.switchings_per_s.mean()),
    }
