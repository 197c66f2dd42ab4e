"""Compare every controller on the same unseen episodes, and say how sure the differences are.

    python training/compare.py --policies runs/seeds --out runs/comparison

The classic controllers are those of controllers/tuned.json; --policies holds a folder per training seed
and missing policies are trained into it. Finished blocks in --out are kept: an interrupted comparison
continues where it stopped. After a change of the plant or of a controller's code, choose another --out.
"""

import training.console.missing_packages  # noqa: F401 - before what may be missing

# isort: split
import argparse
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from controllers.base import Controller
from controllers.oracle import Oracle
from controllers.registry import untuned_controllers
from controllers.tuned import tuned_controllers
from epv_env.common.command_line import (
    check_not_negative,
    check_positive,
    fail_clearly,
    parse_with_quick,
    writable_folder,
)
from epv_env.common.results_folder import only_writer
from epv_env.plant.consumption import MIXED
from epv_env.plant.plantfile import Plant
from epv_env.plant.valves import available_cores
from epv_env.reward import RewardWeights
from training.evaluation.rollout import Trace, run_episodes
from training.evaluation.scenarios import EVALUATION, RANDOM
from training.evaluation.seeds import EVALUATION_SEED, VALIDATION_SEED
from training.learners.policy_folders import (
    END_TO_END_TIMESTEPS,
    RECURRENT_TIMESTEPS,
    seed_folder,
    seed_policies,
    seed_trainings,
    supervised_policies,
    train_missing,
)
from training.learners.settling_search import QUICK_SETTLING, SETTLING
from training.learners.supervision import settle_missing
from training.studies.comparison.comparison_report import (
    PARTS,
    comparison_tables,
    write_figures,
    write_tables,
)
from training.studies.comparison.contenders import Contender, Results, Sizes
from training.studies.comparison.episode_blocks import Block, block_results, plan
from training.studies.comparison.score_tables import ComparisonResults
from training.studies.episode_tasks import Study
from training.studies.generated_pages import check_pages
from training.studies.imported_controllers import HELP, imported_controller, is_import
from training.studies.parallel_run import task_runner
from training.tradeoff import finished_variants, variant

JOURNAL_FILE = "blocks.jsonl"
CURVE_FILE = "learning_curve.csv"

QUICK: dict[str, Any] = {
    "named": 4, "random": 16, "bound": 16, "tuning": 4, "duration": 0.8, "seeds": 1,
    "timesteps": 32_768, "recurrent_seeds": 1, "recurrent_timesteps": 32_768,
    "end_to_end_seeds": 1, "end_to_end_timesteps": 102_400,
    "scenarios": [RANDOM, "steps", "anti-lock"],
}  # fmt: skip
"""The defaults under --quick: everything is done, too little to learn or to conclude anything."""


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line's options, checked."""
    parser = argparse.ArgumentParser(description="Compare controllers (docs/results/comparison.md).")
    parser.add_argument("--out", type=writable_folder, default=Path("runs/comparison"))
    parser.add_argument(
        "--controllers", type=_own, nargs="+", default=[], metavar="MODULE:CLASS", help=HELP
    )
    _add_policies(parser)
    _add_episodes(parser)
    parser.add_argument("--workers", type=int, default=available_cores(), help="processes")
    parser.add_argument("--cluster", help="address of a Dask scheduler to run on instead")
    parser.add_argument("--images", type=writable_folder, help="another folder for the figures")
    parser.add_argument(
        "--pages", type=Path, nargs="+", default=[], help="pages whose generated parts are written"
    )
    chosen = parse_with_quick(parser, arguments, QUICK)
    check_positive(
        parser, chosen,
        "seeds", "recurrent_seeds", "end_to_end_seeds", "timesteps", "recurrent_timesteps",
        "end_to_end_timesteps", "named", "random", "bound", "tuning", "duration", "workers",
    )  # fmt: skip
    check_not_negative(parser, chosen, "seed")
    if chosen.seed + max(chosen.named, chosen.random, chosen.bound) > VALIDATION_SEED - EVALUATION_SEED:
        parser.error(f"--seed {chosen.seed}: give less, from a million on others are trained on them")
    if RANDOM not in chosen.scenarios:
        parser.error(f"--scenarios must hold {RANDOM!r}: the probabilities refer to it")
    return chosen


def _own(source: str) -> str:
    """The name of a controller of one's own, as argparse takes it."""
    if not is_import(source):
        raise argparse.ArgumentTypeError(f"{source!r}: give MODULE:CLASS, for instance mine:Relay")
    return source


def _add_policies(parser: argparse.ArgumentParser) -> None:
    """Options that say which learned policies take part."""
    parser.add_argument(
        "--policies", type=writable_folder, help="folder with a learned policy for each training seed"
    )
    parser.add_argument("--seeds", type=int, default=10, help="training seeds that --policies holds")
    parser.add_argument("--timesteps", type=int, default=2_000_000, help="steps to train a missing one")
    for option, whose, timesteps in (
        ("--recurrent", "policies with a memory", RECURRENT_TIMESTEPS),
        ("--end-to-end", "policies whose memory learns with PPO", END_TO_END_TIMESTEPS),
    ):
        parser.add_argument(option, type=writable_folder, help=f"the same for {whose}")
        parser.add_argument(
            f"{option}-seeds", type=int, default=10, help=f"training seeds that {option} holds"
        )
        parser.add_argument(
            f"{option}-timesteps", type=int, default=timesteps, help="PPO's steps for a missing one"
        )
    parser.add_argument(
        "--tradeoff", type=Path, help="folder of training/tradeoff.py: its controllers join the front"
    )


def _add_episodes(parser: argparse.ArgumentParser) -> None:
    """Options that say which episodes are run, and how many."""
    parser.add_argument("--scenarios", nargs="+", choices=list(EVALUATION), default=list(EVALUATION))
    parser.add_argument("--named", type=int, default=32, help="episodes in each named scenario")
    parser.add_argument("--random", type=int, default=512, help="random ones on the calibrated plant")
    parser.add_argument(
        "--bound", type=int, default=4096,
        help="random ones on each region, to bound the violation rate of ±500 mbar",
    )  # fmt: skip
    parser.add_argument("--tuning", type=int, default=2048, help="episodes that choose a training seed")
    parser.add_argument("--seed", type=int, default=0, help="of the first evaluation episode")
    parser.add_argument("--duration", type=float, default=10.0, help="length of an episode [s]")


def contenders(chosen: argparse.Namespace) -> list[Contender]:
    """Everyone who takes part in all scenarios, the learned ones first and the oracle last."""
    recurrent = chosen.recurrent, chosen.recurrent_seeds, chosen.recurrent_timesteps
    end_to_end = chosen.end_to_end, chosen.end_to_end_seeds, chosen.end_to_end_timesteps
    plain = chosen.policies, chosen.seeds, chosen.timesteps
    kinds = [
        seed_trainings(folder, count=count, timesteps=timesteps, recurrent=remembers, end_to_end=learns)
        for (folder, count, timesteps), remembers, learns in (
            (end_to_end, True, True), (recurrent, True, False), (plain, False, False),
        )
        if folder is not None
    ]  # fmt: skip
    train_missing([training for kind in kinds for training in kind], workers=chosen.workers)
    with_memory = [kind for kind in kinds if kind[0].recurrent]
    folders = [training.folder for kind in with_memory for training in kind]
    settle_missing(folders, workers=chosen.workers, search=QUICK_SETTLING if chosen.quick else SETTLING)
    found = [_learned(supervised_policies(kind)) for kind in with_memory]
    found += [_learned(seed_policies(kind)) for kind in kinds]
    own = [imported_controller(source) for source in chosen.controllers]
    others = [*own, *tuned_controllers(), *untuned_controllers(Plant.calibrated())]
    found += [Contender(name=c.name, runs={c.name: c}) for c in others]
    names = [contender.name for contender in found]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(f"two controllers are called {twice[0]!r}: give yours another name")
    return found


def _learned(policies: Mapping[str, Controller]) -> Contender:
    """The policies of one kind, by the names of their seeds, as one contender."""
    name = next(iter(policies.values())).name
    runs = {f"{name}, {seed}": policy for seed, policy in policies.items()}
    return Contender(name=name, runs=runs, learned=True)


def limit_at_least_price(variants: list[Contender]) -> list[Contender]:
    """The oracle at the variants' least price of switching, if that is below the reward's own."""
    prices = [v.price for v in variants if v.price is not None]
    weights = RewardWeights()
    if not prices or (least := min(prices)) >= weights.switching:
        return []
    return [variant(Oracle(threads=1, weights=replace(weights, switching=least)), least)]


def run_blocks(blocks: list[Block], everyone: list[Contender], chosen: argparse.Namespace) -> Results:
    """The blocks' episodes: those that --out lacks are run, side by side."""
    controllers = {run: controller for c in everyone for run, controller in c.runs.items()}
    study = Study(
        controllers=controllers, plant=Plant.calibrated(), scenario=MIXED, duration=chosen.duration
    )
    with task_runner(chosen.workers, chosen.cluster) as run:
        return block_results(blocks, study, chosen.out / JOURNAL_FILE, run, what="comparison")


def same_episode(c: ComparisonResults, duration: float, first_seed: int) -> dict[str, Trace]:
    """One random episode of the calibrated plant under each contender's chosen run, in time."""
    traces = {}
    for contender in c.contenders:
        controller = contender.runs[c.chosen[contender.name]]
        _, trace = run_episodes(
            controller, seeds=[first_seed], duration=duration, trace_of=0,
            options=EVALUATION[RANDOM].options,
        )  # fmt: skip
        if trace is not None:
            traces[contender.name] = trace
    return traces


def learning_curves(chosen: argparse.Namespace) -> dict[str, pd.DataFrame]:
    """The learning curves that lie beside the policies, by training seed."""
    if chosen.policies is None:
        return {}
    paths = {f"seed {k}": seed_folder(chosen.policies, k) / CURVE_FILE for k in range(chosen.seeds)}
    return {name: pd.read_csv(path) for name, path in paths.items() if path.exists()}


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    chosen = parse(arguments)
    check_pages(chosen.pages, PARTS)
    with only_writer(chosen.out):
        return compare(chosen)


def compare(chosen: argparse.Namespace) -> int:
    """Run, tabulate and draw the comparison; returns the exit status."""
    sizes = Sizes(
        named=chosen.named, random=chosen.random, bound=chosen.bound, tuning=chosen.tuning
    )  # fmt: skip
    everyone = contenders(chosen)
    variants = finished_variants(chosen.tradeoff)
    variants += limit_at_least_price(variants)
    first_seed = EVALUATION_SEED + chosen.seed
    blocks = plan([*everyone, *variants], chosen.scenarios, sizes, first_seed)
    results = run_blocks(blocks, [*everyone, *variants], chosen)
    comparison = ComparisonResults(everyone, chosen.scenarios, results, variants)
    tables = comparison_tables(comparison, trade_off_episodes=chosen.random)
    settings = {name: getattr(chosen, name) for name in (*QUICK, "seed", "quick")}
    print(write_tables(comparison, tables, settings=settings, out=chosen.out, pages=chosen.pages))
    traces, curves = same_episode(comparison, chosen.duration, first_seed), learning_curves(chosen)
    write_figures(comparison, tables, traces=traces, curves=curves, out=chosen.out, images=chosen.images)
    print(f"\nresults in {chosen.out}")
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
