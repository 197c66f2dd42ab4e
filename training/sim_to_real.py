"""The sim-to-real loop: train on the nominal plant, deploy on a bench, diagnose, retrain, deploy again.

    python training/sim_to_real.py --out runs/sim-to-real

The bench is a virtual one. Its valve has an effect that is withheld from every other step: training,
simulation and diagnosis see what a user sees. Finished steps in --out are kept
(docs/results/sim-to-real.md).
"""

import training.console.missing_packages  # noqa: F401 - before what may be missing

# isort: split
import argparse
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from controllers.base import Controller
from controllers.learned import holds_policy, load_policy
from controllers.registry import SIMULATING_KINDS
from controllers.tuned import tuned_controllers
from epv_env.actions import OnOff
from epv_env.common.command_line import (
    check_not_negative,
    check_positive,
    fail_clearly,
    parse_with_quick,
    writable_folder,
)
from epv_env.common.files import decoded, write_text
from epv_env.common.results_folder import check_options, only_writer, write_options
from epv_env.plant.plantfile import Plant, load_plant
from epv_env.reward import RewardWeights
from identification.__main__ import main as identification
from identification.bench.programmes import SUITES
from training.studies.sim_to_real.deployment import (
    AFTER,
    BEFORE,
    MEASURED,
    SIMULATED,
    deployed,
    read_episodes,
)
from training.studies.sim_to_real.sim_to_real_report import report


@dataclass(frozen=True, kw_only=True)
class LoopSettings:
    """How the loop trains and deploys."""

    scenario: str = "mixed"
    """Consumption of trainings and deployments."""
    training_region: str = "ten_percent"
    """Region of plants around the simulated one that PPO trains on: no wider, so that a gap is felt."""
    switching_price: float = 0.2
    """Price of a switching in the reward [1]. Below the default: at a high price, so short a training
    has not learned to control yet."""
    hyperparameters: Mapping[str, Any] = field(
        default_factory=lambda: {"num_envs": 128, "batch_size": 1024, "n_epochs": 4}
    )
    """Of PPO: sixteen times as many updates per environment step as train_ppo.py without a memory:
    it learns in a quarter of the steps."""


SETTINGS = LoopSettings()

QUICK: dict[str, Any] = {"timesteps": 8192, "episodes": 8, "duration": 1.0, "suite": "report"}
"""The defaults under --quick: everything is done, too short to learn anything."""

WITHHELD, CAMPAIGN = "withheld/plant.json", "campaign"
GAP, CORRECTED = "diagnosis/gap.json", "diagnosis/plant.json"
EPISODES = "episodes.csv"


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line's options, checked."""
    parser = argparse.ArgumentParser(
        description="Train, deploy on a bench, diagnose, retrain and deploy again "
        "(docs/results/sim-to-real.md)."
    )
    parser.add_argument(
        "--out", type=writable_folder, default=Path("runs/sim-to-real"), help="folder of results"
    )
    parser.add_argument(
        "--effect", default="pressure_sensor_lag=0.02,0", metavar="NAME=SIZE",
        help="effect of the bench's valve, withheld from the diagnosis (docs/explanation/effects.md)",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, help="of both trainings, sensors, diagnosis")
    parser.add_argument("--timesteps", type=int, default=1_200_000, help="steps of each training")
    parser.add_argument("--episodes", type=int, default=256, help="episodes of each deployment")
    parser.add_argument("--duration", type=float, default=6.0, help="length of one of them [s]")
    parser.add_argument(
        "--suite", choices=SUITES, default="diagnosis", help="recordings that the bench makes"
    )
    parser.add_argument(
        "--images", type=writable_folder, default=None, help="another folder for sim-to-real.png"
    )
    chosen = parse_with_quick(parser, arguments, QUICK)
    check_positive(parser, chosen, "timesteps", "episodes", "duration")
    check_not_negative(parser, chosen, "seed")
    return chosen


def options(chosen: argparse.Namespace) -> dict[str, Any]:
    """What the results depend on."""
    return {name: v for name, v in vars(chosen).items() if name not in ("out", "images", "quick")}


def record(chosen: argparse.Namespace) -> None:
    """Build the bench's valve and record its campaign: the only step that knows the effect.

    It comes first, so that an effect that cannot be used is refused before anything is trained.
    """
    if not (chosen.out / WITHHELD).exists():
        identification([
            "bench", "--suite", chosen.suite, "--effect", chosen.effect, "--seed", str(chosen.seed),
            "--out", str(chosen.out / CAMPAIGN), "--truth", str(chosen.out / WITHHELD),
        ])  # fmt: skip


def diagnose(chosen: argparse.Namespace) -> dict[str, Any]:
    """The diagnosis of the campaign, as gap.json has it; it gets nothing but the recordings."""
    path = chosen.out / GAP  # written last, after the corrected plant
    if not path.exists():
        into = ["--out", str(path.parent), "--seed", str(chosen.seed)]
        identification(["gap", str(chosen.out / CAMPAIGN), *into])
    return decoded(path, remedy=f"remove {path.parent}, and the diagnosis runs again")


def trained(
    folder: Path, plant: Plant, chosen: argparse.Namespace, settings: LoopSettings = SETTINGS
) -> Controller:
    """PPO trained on plants around this one, or as it was trained before."""
    if not holds_policy(folder):
        from training.learners.hyperparameters import Hyperparameters
        from training.learners.policy_files import save_policy  # torch takes seconds to import: only now
        from training.learners.ppo import train

        policy, log = train(
            Hyperparameters(**settings.hyperparameters), folder=folder, plant=plant,
            scenario=settings.scenario, parameters=settings.training_region,
            weights=RewardWeights(switching=settings.switching_price),
            timesteps=chosen.timesteps, seed=chosen.seed, device="cpu", resume=True,
        )  # fmt: skip
        provenance = {
            "run": log.run.run, "plant": plant.name, "timesteps": chosen.timesteps, "seed": chosen.seed,
        }  # fmt: skip
        save_policy(policy, folder, control_period=OnOff.default_period, provenance=provenance)
    return load_policy(folder)


def stage(
    name: str, simulated: Plant, chosen: argparse.Namespace, settings: LoopSettings = SETTINGS
) -> pd.DataFrame:
    """Train on the simulated plant, then deploy in simulation and on the bench's valve.

    Returns the episodes of `deployed` with a column `stage`. The tuned controllers stay as they are.
    """
    folder = chosen.out / name
    policy = trained(folder, simulated, chosen, settings)
    path = folder / EPISODES
    if not path.exists():
        plants = {SIMULATED: simulated, MEASURED: load_plant(chosen.out / WITHHELD)}
        rivals = tuned_controllers(without=SIMULATING_KINDS)
        episodes = deployed(
            [policy, *rivals], plants, scenario=settings.scenario, count=chosen.episodes,
            duration=chosen.duration, what=f"deployment {name}",
        )  # fmt: skip
        write_text(path, episodes.to_csv(index=False))
    return read_episodes(path).assign(stage=name)


def announce(step: str) -> None:
    """Say on stderr, like its progress, which step begins."""
    print(f"[{step}]", file=sys.stderr)


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    chosen = parse(arguments)
    with only_writer(chosen.out):
        return loop(chosen)


def loop(chosen: argparse.Namespace) -> int:
    """The four stages, those that --out lacks; returns the exit status."""
    check_options(chosen.out, options(chosen), "sim-to-real run")
    announce("1 of 4: the bench records its valve")
    record(chosen)
    write_options(chosen.out, options(chosen))
    announce("2 of 4: train on the nominal plant, deploy")
    before = stage(BEFORE, load_plant(None), chosen)
    announce("3 of 4: diagnose the campaign")
    diagnosis = diagnose(chosen)
    announce("4 of 4: train on the corrected plant, deploy")
    after = stage(AFTER, load_plant(chosen.out / CORRECTED), chosen)
    episodes = pd.concat([before, after], ignore_index=True)
    print(report(episodes, diagnosis, withheld=chosen.effect, folder=chosen.out, images=chosen.images))
    print(f"\nresults in {chosen.out}")
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
