"""Controllers for the trade-off of switching against excursion: each optimised at several prices.

    python training/tradeoff.py --prices 0.5 1 2 --out runs/tradeoff

trains PPO and tunes classic controllers at every price; finished controllers in --out are kept. With
--recurrent, PPO also trains a policy with a memory at every price. The command
`training/compare.py --tradeoff runs/tradeoff` measures and draws them.
"""

import training.console.missing_packages  # noqa: F401 - before what may be missing

# isort: split
import argparse
import sys
from pathlib import Path
from typing import Any

import optuna

from controllers.base import Controller
from controllers.learned import holds_policy, load_policy
from controllers.registry import TUNED_KINDS
from controllers.tuned import build, load_search, load_tunings, save_tunings
from epv_env.common.command_line import (
    MOST,
    check_not_negative,
    check_positive,
    fail_clearly,
    writable_folder,
)
from epv_env.common.results_folder import only_writer
from epv_env.plant.plantfile import Plant
from epv_env.plant.valves import available_cores
from epv_env.reward import RewardWeights
from training.evaluation.scenarios import TUNING_REGION
from training.learners.policy_folders import (
    MEMORYLESS_TIMESTEPS,
    RECURRENT_TIMESTEPS,
    Training,
    seed_trainings,
    train_missing,
)
from training.studies.comparison.contenders import Contender
from training.tune import tune

FOLDER = "price-{:g}"
TUNED_FILE = "tuned.json"
RECURRENT_FOLDER = "recurrent"
"""Within that of a price."""


def variant(controller: Controller, price: float) -> Contender:
    """A controller that was optimised at a price of switching."""
    return Contender(
        name=controller.name, runs={f"{controller.name}, price {price:g}": controller}, price=price
    )


def tuned_at(folder: Path, kinds: list[str], price: float, trials: int, seed: int) -> None:
    """Tune the classic controllers at this price, but those that are tuned already."""
    path = folder / TUNED_FILE
    search = {
        "method": "Optuna TPE on the mean return", "trials": trials, "episodes": 128, "duration": 6.0,
        "seed": seed, "parameters": TUNING_REGION, "switching_price": price,
    }  # fmt: skip
    options: dict[str, Any] = {
        "parameters": TUNING_REGION, "weights": RewardWeights(switching=price),
    }  # fmt: skip
    if path.exists() and load_search(path) != search:
        raise ValueError(
            f"{path} was searched with {load_search(path)}, not {search}: choose another --out"
        )
    tunings = load_tunings(path) if path.exists() else {}
    for kind in kinds:
        if kind not in tunings:
            tunings[kind] = tune(
                kind, trials=trials, episodes=128, duration=6.0, seed=seed, options=options
            )
            save_tunings(tunings, path, search)


def finished_variants(folder: Path | None) -> list[Contender]:
    """The controllers that a folder of this command holds, by price; none without a folder.

    Raises ValueError if the folder holds none.
    """
    if folder is None:
        return []
    variants: list[Contender] = []
    for path in sorted(folder.glob("price-*")):
        price = float(path.name.removeprefix("price-"))
        controllers: list[Controller] = []
        learned = (path, path / RECURRENT_FOLDER)
        controllers += [load_policy(each) for each in learned if holds_policy(each)]
        if (path / TUNED_FILE).exists():
            tunings = load_tunings(path / TUNED_FILE)
            plant = Plant.calibrated()
            controllers += [build(kind, tuning.values, plant) for kind, tuning in tunings.items()]
        variants += [variant(controller, price) for controller in controllers]
    if not variants:
        raise ValueError(f"{folder} holds no controllers: make them with `python training/tradeoff.py`")
    return variants


def first_memory(chosen: argparse.Namespace) -> Training | None:
    """The policy with a memory whose student the variants go on from, if they shall.

    Raises ValueError or PolicyError if it is there and PPO cannot go on from it.
    """
    if chosen.recurrent is None:
        return None
    from training.learners.student import load_student  # torch takes seconds to import: only now

    (first,) = seed_trainings(
        chosen.recurrent, count=1, timesteps=RECURRENT_TIMESTEPS, recurrent=True
    )  # fmt: skip
    if first.finished:
        load_student(first.own_student)
    return first


def train_variants(chosen: argparse.Namespace, first: Training | None) -> None:
    """Train what is missing at every price, and `first`."""
    at = [(chosen.out / FOLDER.format(p), RewardWeights(switching=p)) for p in chosen.prices]
    plain = [
        Training(folder=folder, weights=weights, timesteps=chosen.timesteps, seed=chosen.seed)
        for folder, weights in at
    ]
    if first is None:
        train_missing(plain, workers=chosen.workers)
        return
    train_missing([first, *plain], workers=chosen.workers)
    remembering = [
        Training(
            folder=folder / RECURRENT_FOLDER, weights=weights, recurrent=True,
            student=first.own_student, memoryless=folder, timesteps=chosen.timesteps, seed=chosen.seed,
        )
        for folder, weights in at
    ]  # fmt: skip
    train_missing(remembering, workers=chosen.workers)


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(description="Optimise controllers at several prices of switching.")
    parser.add_argument("--out", type=writable_folder, default=Path("runs/tradeoff"))
    parser.add_argument("--prices", type=float, nargs="+", default=[0.5, 1.0, 2.0])
    parser.add_argument(
        "--timesteps",
        type=int,
        default=MEMORYLESS_TIMESTEPS,
        help="training steps at each price",
    )
    parser.add_argument(
        "--kinds", nargs="+", choices=TUNED_KINDS, default=["hysteresis, extrapolating"],
        help="classic controllers to tune",
    )  # fmt: skip
    parser.add_argument("--trials", type=int, default=100, help="tuning evaluations of each of them")
    parser.add_argument(
        "--recurrent", type=writable_folder,
        help="folder of policies with a memory, as compare.py fills it: PPO takes the student of its "
        "first training seed, which is trained if it is missing",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--workers", type=int, default=available_cores(), help="processes that train"
    )  # fmt: skip
    chosen = parser.parse_args(arguments)
    check_positive(parser, chosen, "timesteps", "trials", "workers")
    check_not_negative(parser, chosen, "seed")
    if not all(0 <= price <= MOST["switching_price"] for price in chosen.prices):
        parser.error(f"--prices must lie between 0 and {MOST['switching_price']:g}")
    first = first_memory(chosen)
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    with only_writer(chosen.out):
        for price in chosen.prices:
            folder = chosen.out / FOLDER.format(price)
            tuned_at(folder, chosen.kinds, price, chosen.trials, chosen.seed)
        train_variants(chosen, first)
    print(f"controllers in {chosen.out}; measure them with training/compare.py --tradeoff {chosen.out}")
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
