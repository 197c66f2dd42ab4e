"""Robustness of each controller: plants, effects, sensors and timing far off, and the worst case.

    python training/sweep.py --out runs/sweep
    python training/sweep.py --out runs/sweep --cluster tcp://HOST:8786

A sweep that was stopped continues where it stopped when it is started again. docs/results/robustness.md
explains the method.
"""

import training.console.missing_packages  # noqa: F401 - before what may be missing

# isort: split
import argparse
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

from epv_env.common.command_line import (
    check_not_negative,
    check_positive,
    fail_clearly,
    parse_with_quick,
    writable_folder,
)
from epv_env.common.files import Journal, write_json
from epv_env.common.results_folder import check_options, only_writer, write_options
from epv_env.plant.consumption import check_scenario
from epv_env.plant.plantfile import Plant, load_plant
from epv_env.plant.valves import available_cores
from training.evaluation.seeds import CALIBRATION_SEED, SWEEP_SEED
from training.learners.provenance import plant_digest
from training.studies.episode_tasks import Study
from training.studies.generated_pages import check_pages
from training.studies.named_controllers import DEFAULT, HELP, named_controllers
from training.studies.parallel_run import run_tasks, task_runner
from training.studies.sweeps.computing_cost import cost, episode_cpu, overhead
from training.studies.sweeps.episode_plan import Size, cells, chosen_points, searches
from training.studies.sweeps.experiment_designs import DESIGNS, Point
from training.studies.sweeps.sweep_report import PARTS, SweepResults, report
from training.studies.sweeps.worst_case_search import Effort

JOURNAL, COST = "finished.jsonl", "cost.json"
LEAST_SCREENED = 8
"""Plants that a worst-case search needs at least: a generation of differential evolution."""

QUICK: dict[str, Any] = {
    "controllers": DEFAULT[:1], "episodes": 4, "joint_episodes": 16, "duration": 0.6, "screened": 16,
    "generations": 1,
    "factors": ["R", "V2", "piston_friction", "sensor noise", "control period", "latency"],
}  # fmt: skip
"""The defaults under --quick: everything is done, with too few episodes to tell anything."""


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line's options, checked."""
    parser = argparse.ArgumentParser(
        description="Robustness of controllers (docs/results/robustness.md)."
    )
    parser.add_argument(
        "--out", type=writable_folder, default=Path("runs/sweep"), help="folder of results"
    )
    _add_plan(parser)
    parser.add_argument("--workers", type=int, default=None, help="processes; default: all cores")
    parser.add_argument("--cluster", default=None, help="address of a Dask scheduler, tcp://HOST:8786")
    parser.add_argument(
        "--images", type=writable_folder, default=None, help="another folder for the figures"
    )
    parser.add_argument(
        "--pages", type=Path, nargs="+", default=[], help="pages whose generated parts are written"
    )
    chosen = parse_with_quick(parser, arguments, QUICK)
    check_positive(
        parser, chosen, "episodes", "joint_episodes", "duration", "screened", "generations", "workers"
    )  # fmt: skip
    check_not_negative(parser, chosen, "seed")
    _check_episodes(parser, chosen)
    return chosen


def _add_plan(parser: argparse.ArgumentParser) -> None:
    """Options that say what is run."""
    parser.add_argument("--controllers", nargs="+", default=list(DEFAULT), metavar="NAME", help=HELP)
    parser.add_argument("--designs", nargs="+", choices=DESIGNS, default=list(DESIGNS))
    parser.add_argument(
        "--factors", nargs="+", default=[], help="change only these, one at a time; default: all"
    )
    parser.add_argument("--episodes", type=int, default=128, help="at each point that changes one thing")
    parser.add_argument(
        "--joint-episodes", type=int, default=4096, help="at each region, and in the hypercube"
    )
    parser.add_argument("--screened", type=int, default=1024, help="plants that begin a search")
    parser.add_argument("--generations", type=int, default=15, help="of that search")
    parser.add_argument("--duration", type=float, default=10.0, help="length of an episode [s]")
    parser.add_argument("--scenario", default="mixed", help="consumption, where it is not what changes")
    parser.add_argument("--plant", default=None, help="plant file; default: the report's calibration")
    parser.add_argument("--seed", type=int, default=0, help="of episodes, hypercube and searches")


def _check_episodes(parser: argparse.ArgumentParser, chosen: argparse.Namespace) -> None:
    """Refuse a search that is too small, and episodes that reach into another range of seeds."""
    if chosen.screened < LEAST_SCREENED:
        parser.error(f"--screened must be at least {LEAST_SCREENED}")
    used = max(chosen.episodes, chosen.joint_episodes, 2 * chosen.screened)
    most = CALIBRATION_SEED - SWEEP_SEED - used
    if chosen.seed > most:
        parser.error(
            f"--seed {chosen.seed} would meet episodes kept for exports (evaluation/seeds.py): with "
            f"{used} episodes give one up to {most}"
        )


def configuration(
    chosen: argparse.Namespace, size: Size, plant: Plant, digests: dict[str, str]
) -> dict[str, Any]:
    """Everything that the results depend on."""
    depends = ("designs", "factors", "scenario", "duration", "seed")
    return {
        "software": version("epv-valve"),
        "controllers": digests,
        "plant": {"name": plant.name, "sha256": plant_digest(plant)},
        "size": {
            "episodes": size.episodes,
            "joint_episodes": size.joint_episodes,
            "effort": {"screened": size.effort.screened, "generations": size.effort.generations},
        },
        "first_seed": SWEEP_SEED,
        **{name: getattr(chosen, name) for name in depends},
    }


def sweep(
    chosen: argparse.Namespace, config: dict[str, Any], study: Study, size: Size, points: list[Point]
) -> SweepResults:
    """Run the points and worst-case searches that --out lacks, and estimate the computing cost."""
    names = list(study.controllers)
    planned = cells(points, names, size, chosen.seed)
    searched = "worst" in chosen.designs
    worst = searches(study.plant, names, size, chosen.seed) if searched else []
    tasks = [*worst, *(batch for cell in planned for batch in cell.batches)]
    cores = available_cores()
    with task_runner(chosen.workers or cores, chosen.cluster) as run:
        write_options(chosen.out, config)
        outcomes = run_tasks(tasks, study, Journal(chosen.out / JOURNAL, config), run, what="sweep")
        handing_out = overhead(run, study)
    estimate = cost(
        episode_cpu(planned, outcomes), handing_out, cores=cores, duration=chosen.duration,
        where="Dask" if chosen.cluster else "joblib",
    )  # fmt: skip
    return SweepResults(
        configuration=config, cells=planned, searches=worst, outcomes=outcomes, study=study,
        cost_estimate=estimate,
    )  # fmt: skip


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    chosen = parse(arguments)
    check_pages(chosen.pages, PARTS)
    check_scenario(chosen.scenario)
    plant = load_plant(chosen.plant)
    with only_writer(chosen.out):
        return run_and_report(chosen, plant)


def run_and_report(chosen: argparse.Namespace, plant: Plant) -> int:
    """Run what --out lacks, and write the tables and figures; returns the exit status."""
    controllers, digests = named_controllers(chosen.controllers, plant)
    size = Size(
        episodes=chosen.episodes, joint_episodes=chosen.joint_episodes,
        effort=Effort(screened=chosen.screened, generations=chosen.generations),
    )  # fmt: skip
    points = chosen_points(plant, chosen.designs, chosen.factors, size, chosen.seed)
    config = configuration(chosen, size, plant, digests)
    check_options(chosen.out, config, "sweep")
    study = Study(
        controllers=controllers, plant=plant, scenario=chosen.scenario, duration=chosen.duration
    )
    results = sweep(chosen, config, study, size, points)
    write_json(chosen.out / COST, results.cost_estimate)
    print(report(results, chosen.out, images=chosen.images, pages=chosen.pages))
    print(f"\nresults in {chosen.out}")
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
