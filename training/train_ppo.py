"""Train PPO to limit the circuit pressure, then compare it with hysteresis and PWM control.

    python training/train_ppo.py

writes policy, configuration, table and figures into runs/ppo and prints the table.
"""

import argparse
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from tqdm import tqdm

from controllers.learned import load_policy
from controllers.pwm import PWM
from controllers.registry import SIMULATING_KINDS
from controllers.supervised import load_supervised, save_settings
from controllers.tuned import tuned_controllers
from epv_env.actions import OnOff
from epv_env.common.command_line import (
    check_not_negative,
    check_positive,
    fail_clearly,
    parse_with_quick,
    writable_folder,
)
from epv_env.common.files import write_json, write_text
from epv_env.common.results_folder import check_same, only_writer, read_config, write_options
from epv_env.plant.consumption import check_scenario
from epv_env.plant.plantfile import Plant, load_plant
from epv_env.plant.region import REGIONS
from epv_env.reward import RewardWeights
from training.evaluation.controller_table import Comparison, as_text, compare
from training.evaluation.scenarios import TUNING_REGION
from training.learners.policy_folders import (
    END_TO_END_TIMESTEPS,
    MEMORYLESS_TIMESTEPS,
    RECURRENT_TIMESTEPS,
)
from training.learners.provenance import Configuration, configuration
from training.learners.run_folder import forget_failed_start, make_free, why_taken
from training.learners.run_state import check_checkpoint, new_run
from training.learners.tracking import HELP, check_tracking, tracked

SAME_WHEN_RESUMED = (
    "seed", "plant", "scenario", "parameters", "switching_price", "memory", "end_to_end",
)  # fmt: skip
"""Options that a resumed training must share with its beginning."""

QUICK = {"timesteps": 65_536, "episodes": 16, "duration": 2.0}
"""The defaults under --quick: everything is done, too short to learn anything."""
QUICK_HYPERPARAMETERS: dict[str, Any] = {
    "num_envs": 32, "batch_size": 1024, "critic_first": 2000, "imitation_epochs": 1, "validations": 1,
    "validation_episodes": 16, "validation_duration": 2.0,
}  # fmt: skip

QUICK_DISTILLATION: dict[str, Any] = {
    "rounds": 2, "plants": 16, "episodes": 32, "periods": 100, "window": 50, "steps": 4, "batch": 16,
    "validations": 1, "validation_episodes": 16, "validation_duration": 2.0,
}  # fmt: skip


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line's options, checked."""
    parser = argparse.ArgumentParser(
        description="Train PPO and compare it with hysteresis and PWM control."
    )
    parser.add_argument(
        "--out", type=writable_folder, default=Path("runs/ppo"), help="folder of results"
    )
    parser.add_argument(
        "--timesteps", type=int,
        help=f"environment steps of PPO; default: {END_TO_END_TIMESTEPS}, without memory "
        f"{MEMORYLESS_TIMESTEPS}, not end to end {RECURRENT_TIMESTEPS}",
    )  # fmt: skip
    parser.add_argument("--episodes", type=int, default=256, help="evaluation episodes per plant set")
    parser.add_argument("--duration", type=float, default=10.0, help="length of one of them [s]")
    parser.add_argument("--seed", type=int, default=0, help="of the training")
    parser.add_argument("--plant", default=None, help="plant file; default: the report's calibration")
    parser.add_argument("--scenario", default="mixed", help="consumption scenario")
    parser.add_argument(
        "--parameters", choices=REGIONS, default=TUNING_REGION, help="plants to train on"
    )
    parser.add_argument(
        "--switching-price",
        type=float,
        default=RewardWeights().switching,
        help="reward's price of one switching of the coil: trades wear against excursions",
    )
    parser.add_argument(
        "--memory", action=argparse.BooleanOptionalAction, default=True,
        help="a policy with a memory, which first imitates a controller that knows each valve's plant",
    )  # fmt: skip
    parser.add_argument(
        "--end-to-end", action=argparse.BooleanOptionalAction, default=None,
        help="the memory learns with PPO, too, under a critic that sees the true state; default: yes",
    )  # fmt: skip
    parser.add_argument(
        "--device", default="cpu", help="torch device; cpu is fastest for so small a net"
    )
    parser.add_argument("--track", action="store_true", help=HELP)
    again = parser.add_mutually_exclusive_group()
    again.add_argument("--resume", action="store_true", help="go on from the folder's checkpoint")
    again.add_argument(
        "--force", action="store_true", help="begin anew in a folder that holds a training already"
    )
    chosen = parse_with_quick(parser, arguments, QUICK)
    if chosen.end_to_end and not chosen.memory:
        parser.error("--end-to-end trains a memory: leave --no-memory out")
    if chosen.end_to_end is None:
        chosen.end_to_end = chosen.memory
    if chosen.timesteps is None:
        recurrent = END_TO_END_TIMESTEPS if chosen.end_to_end else RECURRENT_TIMESTEPS
        chosen.timesteps = recurrent if chosen.memory else MEMORYLESS_TIMESTEPS
    check_positive(parser, chosen, "timesteps", "episodes", "duration")
    check_not_negative(parser, chosen, "seed", "switching_price")
    return chosen


def identity(chosen: argparse.Namespace) -> str:
    """The run to go on with, or a new one in a folder that is free.

    Raises ValueError if the folder is not free, or cannot be resumed with these options.
    """
    if not chosen.resume:
        make_free(chosen.out, force=chosen.force or _replace_asked(chosen.out))
        return new_run()
    config = read_config(chosen.out, Configuration)
    if config is None:
        raise ValueError(f"nothing to resume in {chosen.out}: leave --resume out")
    options = {name: getattr(chosen, name) for name in SAME_WHEN_RESUMED}
    check_same(config["options"], options, f"{chosen.out} was trained with", "resume with the same")
    check_checkpoint(chosen.out, config["run"])  # before anything is written
    return config["run"]


def _replace_asked(folder: Path) -> bool:
    """Whether the user, asked in a terminal, wants to replace what a folder holds."""
    taken = why_taken(folder)
    if taken is None or not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    print(taken, file=sys.stderr)
    return input("begin anew, and remove what that training wrote? [y/N] ").strip().lower() == "y"


def evaluate(chosen: argparse.Namespace, plant: Plant) -> Comparison:
    """The comparison on unseen scenarios, with a progress bar."""
    alone = load_policy(chosen.out)
    contenders = [
        *([load_supervised(chosen.out, plant)] if alone.cells else []),
        alone,
        *tuned_controllers(plant, without=SIMULATING_KINDS),
    ]
    with tqdm(
        total=100,
        desc="evaluation",
        unit="%",
        bar_format="{l_bar}{bar}| {elapsed}<{remaining} {postfix}",
    ) as bar:

        def show(what: str, share: float) -> None:
            bar.set_postfix_str(what)
            bar.update(100 * share - bar.n)

        comparison = compare(
            contenders, plant=plant, scenario=chosen.scenario, episodes=chosen.episodes,
            duration=chosen.duration, progress=show,
        )  # fmt: skip
    for contender in contenders:
        if isinstance(contender, PWM):
            print(f"design of the PWM loop: {contender.design}\n")
    return comparison


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    chosen = parse(arguments)
    plant = load_plant(chosen.plant)
    check_scenario(chosen.scenario)
    check_tracking(chosen.track)
    with only_writer(chosen.out):
        run = identity(chosen)
        try:
            return train_and_compare(chosen, plant, run)
        finally:
            forget_failed_start(chosen.out)


def check_device(name: str) -> None:
    """Raises ValueError unless torch can hold a number on the device of this name."""
    import torch

    try:
        torch.zeros(1, device=name)
    except (RuntimeError, AssertionError) as error:
        reason = str(error).splitlines()[0]
        raise ValueError(f"--device {name!r}: {reason}: give cpu, or a device of this machine") from None


def train_and_compare(chosen: argparse.Namespace, plant: Plant, run: str) -> int:
    """Train, write the policy down, and compare it; returns the exit status."""
    from training.learners.distillation import FOR_END_TO_END, Distillation
    from training.learners.hyperparameters import Hyperparameters, recurrent_hyperparameters
    from training.learners.policy_files import save_policy
    from training.learners.ppo import train
    from training.learners.recurrent_training import train_recurrent
    from training.learners.settling_search import QUICK_SETTLING, SETTLING
    from training.learners.supervision import settle

    check_device(chosen.device)
    weights = RewardWeights(switching=chosen.switching_price)
    hyperparameters = Hyperparameters()
    if chosen.memory:
        hyperparameters = recurrent_hyperparameters(weights, end_to_end=chosen.end_to_end)
    distillation = FOR_END_TO_END if chosen.end_to_end else Distillation()
    if chosen.quick:
        hyperparameters = replace(hyperparameters, **QUICK_HYPERPARAMETERS)
        distillation = replace(distillation, **QUICK_DISTILLATION)
    config = configuration(vars(chosen), plant, hyperparameters, run=run)
    if chosen.memory:
        config["distillation"] = asdict(distillation)
    write_options(chosen.out, config)
    task: dict[str, Any] = {
        "folder": chosen.out, "plant": plant, "scenario": chosen.scenario,
        "parameters": chosen.parameters, "weights": weights,
        "timesteps": chosen.timesteps, "seed": chosen.seed, "device": chosen.device,
        "resume": chosen.resume, "run": run,
    }  # fmt: skip
    with tracked(chosen.track, name=chosen.out.name, folder=chosen.out, config=config):
        if chosen.memory:
            policy, log = train_recurrent(hyperparameters, distillation, **task)
        else:
            policy, log = train(hyperparameters, **task)
    save_policy(policy, chosen.out, control_period=OnOff.default_period, provenance=config)
    if chosen.memory:
        episodes = {"scenario": chosen.scenario, "parameters": chosen.parameters, "weights": weights}
        search = QUICK_SETTLING if chosen.quick else SETTLING
        save_settings(settle(policy, plant, episodes, search), chosen.out)
    comparison = evaluate(chosen, plant)
    report(comparison, log.rows, chosen.out)
    return 0


def report(comparison: Comparison, curve: list[dict[str, float]], folder: Path) -> None:
    """Write table and figures, and print the table."""
    from training.evaluation import plots

    table = comparison.table
    write_text(folder / "table.csv", table.to_csv(index=False))
    write_json(folder / "table.json", table.to_dict(orient="records"))
    plots.learning_curve(curve, folder / "learning_curve.png")
    plots.episode_overlay(comparison.traces, folder / "episode.png")
    plots.excursion_distribution(comparison, folder / "excursions.png")
    print(as_text(table))
    if curve:
        rate = curve[-1]["timesteps"] / max(curve[-1]["seconds"], 1e-9)
        print(f"\ntrained {curve[-1]['timesteps']:.0f} steps at {rate:.0f} steps/s; results in {folder}")


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
