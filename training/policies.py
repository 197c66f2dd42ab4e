"""Learned policies, one folder each: trained if they are missing, loaded if they are there."""

from pathlib import Path
from typing import Any

from controllers.base import Controller
from controllers.learned import CONTRACT_FILE, load_policy
from epv_env.actions import OnOff
from epv_env.plant.consumption import MIXED
from epv_env.plant.plantfile import Plant
from epv_env.reward import RewardWeights
from training.tune import TUNING_REGION

RECURRENT_TIMESTEPS = 5_000_000
"""PPO's steps for a policy with a memory."""


def trained_policy(
    folder: Path,
    *,
    timesteps: int,
    seed: int,
    weights: RewardWeights | None = None,
    recurrent: bool = False,
    student: Path | None = None,
) -> Controller:
    """PPO on the report's plant within ±10 %, or as it was trained before.

    weights: prices of the reward; None: the environment's own. recurrent: with a memory
    (training/distil.py). student: folder of the one that this goes on from; None: it is trained, too.
    An interrupted training goes on.
    """
    if not (folder / CONTRACT_FILE).exists():
        from training.distil import train_recurrent  # torch takes seconds to import: only now
        from training.policy_files import save_policy
        from training.ppo import Hyperparameters, train

        chosen = weights or RewardWeights()
        task: dict[str, Any] = {
            "plant": Plant.calibrated(), "scenario": MIXED, "parameters": TUNING_REGION,
            "weights": chosen, "timesteps": timesteps, "seed": seed, "device": "cpu", "resume": True,
        }  # fmt: skip
        if recurrent:
            policy, _ = train_recurrent(folder=folder, student=student, **task)
        else:
            policy, _ = train(Hyperparameters(), folder=folder, **task)
        provenance = {"timesteps": timesteps, "seed": seed, "switching_price": chosen.switching}
        save_policy(policy, folder, control_period=OnOff.default_period, provenance=provenance)
    return load_policy(folder)


def seed_folder(folder: Path, seed: int) -> Path:
    """Where the policy of a training seed lies among those of a folder."""
    return folder / f"seed-{seed}"


def trained_seeds(
    folder: Path, *, count: int, timesteps: int, recurrent: bool = False
) -> dict[str, Controller]:
    """One policy per training seed 0, 1, ..., by name."""
    return {
        f"seed {seed}": trained_policy(
            seed_folder(folder, seed), timesteps=timesteps, seed=seed, recurrent=recurrent
        )
        for seed in range(count)
    }
