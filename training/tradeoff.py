"""Switching against excursion: PPO and the extrapolating hysteresis, each optimised at several prices.

    python training/tradeoff.py --prices 0.2 0.3 0.5

What is finished in --out is kept and not done again.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import optuna
import pandas as pd

from controllers.base import Controller
from controllers.learned import CONTRACT_FILE, load_policy
from controllers.tuned import build, load_tunings, save_tunings, tuned_controllers
from epv_env.actions import OnOff
from epv_env.plant.commandline import fail_clearly, writable_folder
from epv_env.plant.files import write_text
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant
from epv_env.plant.region import Region
from epv_env.reward import RewardWeights
from training.evaluate import EVALUATION_SEED, HEADINGS, summary
from training.rollout import run_episodes
from training.tune import TUNING_REGION, tune

RIVAL = "hysteresis, extrapolating"
TUNED_FILE = "tuned.json"


def learned(folder: Path, price: float, timesteps: int, seed: int) -> Controller:
    """PPO trained at this price, or as it was trained before."""
    if not (folder / CONTRACT_FILE).exists():
        from training.policy_files import save_policy
        from training.ppo import Hyperparameters, train

        model, _ = train(
            Hyperparameters(), folder=folder, plant=Plant.calibrated(), scenario="mixed",
            parameters=TUNING_REGION, weights=RewardWeights(switching=price), timesteps=timesteps,
            seed=seed, device="cpu", resume=True,
        )  # fmt: skip
        save_policy(
            model,
            folder,
            control_period=OnOff.default_period,
            provenance={"switching_price": price, "seed": seed},
        )
    return load_policy(folder)


def rival(folder: Path, price: float, trials: int, seed: int) -> Controller:
    """The classic rival tuned at this price, or as it was tuned before."""
    path = folder / TUNED_FILE
    if not path.exists():
        options: dict[str, Any] = {
            "parameters": TUNING_REGION, "weights": RewardWeights(switching=price),
        }  # fmt: skip
        found = tune(RIVAL, trials=trials, episodes=128, duration=6.0, seed=seed, options=options)
        save_tunings({RIVAL: found}, path, {"trials": trials, "switching_price": price, "seed": seed})
    return build(RIVAL, load_tunings(path)[RIVAL].values, Parameters.calibrated())


def measure(controller: Controller, episodes: int, duration: float) -> dict[str, float]:
    """Its figures on unseen scenarios with plants within ±10 %."""
    region = Region.named(TUNING_REGION, Parameters.calibrated())
    seeds = list(range(EVALUATION_SEED, EVALUATION_SEED + episodes))
    metrics, _ = run_episodes(controller, seeds=seeds, duration=duration, options={"parameters": region})
    return summary(metrics)


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(description="Switching against excursion at several prices.")
    parser.add_argument("--out", type=writable_folder, default=Path("runs/tradeoff"))
    parser.add_argument("--prices", type=float, nargs="+", default=[0.2, 0.3, 0.5])
    parser.add_argument("--timesteps", type=int, default=5_000_000, help="training steps at each price")
    parser.add_argument("--trials", type=int, default=60, help="tuning evaluations at each price")
    parser.add_argument("--episodes", type=int, default=256)
    parser.add_argument("--duration", type=float, default=10.0, help="length of an episode [s]")
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args(arguments)
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    rows = []
    for price in chosen.prices:
        folder = chosen.out / f"price-{price:g}"
        for controller in (
            learned(folder, price, chosen.timesteps, chosen.seed),
            rival(folder, price, chosen.trials, chosen.seed),
        ):
            figures = measure(controller, chosen.episodes, chosen.duration)
            rows.append({"controller": controller.name, "switching_price": price, **figures})
    for controller in tuned_controllers():
        if controller.name == "PWM":
            figures = measure(controller, chosen.episodes, chosen.duration)
            rows.append({"controller": "PWM", "switching_price": RewardWeights().switching, **figures})

    from training.plots import tradeoff

    table = pd.DataFrame(rows)
    write_text(chosen.out / "table.json", json.dumps(rows, indent=1) + "\n")
    tradeoff(table, chosen.out / "tradeoff.png")
    shown = ["switching_price", *HEADINGS]
    print(table.loc[:, shown].to_string(index=False, float_format="%.3f"))
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
