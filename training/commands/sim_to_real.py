"""Train on the nominal plant, deploy on a bench, diagnose, retrain, deploy again.

    epv sim-to-real --out runs/sim-to-real

The bench is a virtual one. Its valve has an effect that is withheld from every other step: training,
simulation and diagnosis see what a user sees. Finished steps in --out are kept.
"""

import argparse
import importlib
import sys
from pathlib import Path
from typing import Any

from controllers.base import Controller
from controllers.policy import load_policy
from controllers.policy_files import holds_policy
from controllers.tuned import tuned_controllers
from epv_env.common.command_line import COUNT, SECONDS, NextStep, add_out, add_seed, beside
from epv_env.common.commands import parse
from epv_env.common.files import Journal, decoded, write_json, write_text
from epv_env.common.results_folder import check_options, write_options
from epv_env.plant.plantfile import Plant, load_plant
from epv_env.reward import RewardWeights
from identification.bench.programmes import SUITES
from training.evaluation.metrics import EpisodeMetrics
from training.evaluation.scenarios import EvaluationScenario
from training.studies.comparison import compare
from training.studies.sim_to_real import (
    AFTER,
    AROUND,
    BEFORE,
    ITSELF,
    MEASURED,
    SIMULATED,
    Deployments,
    diagnosis_text,
    gap_table,
    performance_figure,
    performance_table,
    short_table,
)

QUICK: dict[str, Any] = {"timesteps": 8192, "episodes": 8, "duration": 1.0, "suite": "report"}

SCENARIO = "mixed"
"""Consumption of trainings and deployments."""
TRAINING_REGION = "ten_percent"
"""Plants around the simulated one that PPO trains on: no wider, so that a gap is felt."""
SWITCHING_PRICE = 0.2
"""Price of a switching in the reward [1]. Below the default: at a high price, so short a training has
not learned to control yet."""

WITHHELD, CAMPAIGN = "withheld/plant.json", "campaign"
GAP, CORRECTED = "diagnosis/gap.json", "diagnosis/plant.json"
RESULT, PICTURE = "sim-to-real.json", "sim-to-real.png"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_out(parser, "runs/sim-to-real")
    parser.add_argument(
        "--effect", default="pressure_sensor_lag=0.02,0", metavar="NAME=SIZE",
        help="effect of the bench's valve, withheld from the diagnosis (docs/explanation/effects.md)",
    )  # fmt: skip
    add_seed(parser, help="of both trainings, sensors, diagnosis")
    parser.add_argument("--timesteps", type=COUNT, default=1_200_000, help="steps of each training")
    parser.add_argument("--episodes", type=COUNT, default=256, help="episodes of each deployment")
    parser.add_argument("--duration", type=SECONDS, default=6.0, help="length of one of them [s]")
    parser.add_argument(
        "--suite", choices=SUITES, default="diagnosis", help="recordings that the bench makes"
    )


def run(options: argparse.Namespace) -> None:
    """The four steps, those that --out lacks; write sim-to-real.json, tables and the picture.

    Raises ValueError for a folder that was begun with other options, or an effect that cannot be used.
    """
    settings = {name: v for name, v in vars(options).items() if name not in ("out", "quick")}
    check_options(options.out, settings, "sim-to-real run")
    _announce("1 of 4: the bench records its valve")
    record(options)
    write_options(options.out, settings)
    _announce("2 of 4: train on the nominal plant, deploy")
    before = stage(BEFORE, load_plant(None), options)
    _announce("3 of 4: diagnose the campaign")
    diagnosis = diagnose(options)
    _announce("4 of 4: train on the corrected plant, deploy")
    after = stage(AFTER, load_plant(options.out / CORRECTED), options)
    print(report({**before, **after}, diagnosis, options.effect, options.out))
    print(f"\nresults in {options.out}")


def next_step(options: argparse.Namespace) -> NextStep:
    """Compare the two policies on the bench's valve."""
    policies = [f"{name}={options.out / name}" for name in (BEFORE, AFTER)]
    valve = ("--plant", options.out / WITHHELD)
    words = ("compare", "--controllers", *policies, *valve, "--out", beside(options.out, "comparison"))
    return NextStep("to compare both policies on the bench's valve", words)


def record(options: argparse.Namespace) -> None:
    """Build the bench's valve and record its campaign: the only step that knows the effect.

    It comes first, so that an effect that cannot be used is refused before anything is trained.
    """
    if not (options.out / WITHHELD).exists():
        _identification("bench", [
            "--suite", options.suite, "--effect", options.effect, "--seed", str(options.seed),
            "--out", str(options.out / CAMPAIGN), "--truth", str(options.out / WITHHELD),
        ])  # fmt: skip


def diagnose(options: argparse.Namespace) -> dict[str, Any]:
    """The diagnosis of the campaign, as gap.json has it; it gets nothing but the recordings."""
    path = options.out / GAP  # written last, after the corrected plant
    if not path.exists():
        into = ["--out", str(path.parent), "--seed", str(options.seed)]
        _identification("gap", [str(options.out / CAMPAIGN), *into])
    return decoded(path, remedy=f"remove {path.parent}, and the diagnosis runs again")


def trained(folder: Path, plant: Plant, options: argparse.Namespace) -> Controller:
    """PPO trained on plants around this one, or as it was trained before."""
    if not holds_policy(folder):
        from training.learners.ppo import Task, train  # torch takes seconds to import: only now

        task = Task(
            plant=plant, scenario=SCENARIO, parameters=TRAINING_REGION,
            weights=RewardWeights(switching=SWITCHING_PRICE),
        )  # fmt: skip
        train(
            task, folder, seed=options.seed, timesteps=options.timesteps, resume=True,
            provenance={"plant": plant.name},
        )  # fmt: skip
    return load_policy(folder, plant)


def stage(name: str, simulated: Plant, options: argparse.Namespace) -> Deployments:
    """Train on the simulated plant, then deploy in simulation and on the bench's valve.

    The classic controllers keep their tuning for the nominal plant.
    """
    folder = options.out / name
    everyone = [trained(folder, simulated, options), *tuned_controllers()]
    scenario = EvaluationScenario(meaning="as in training", options={"scenario": SCENARIO})
    deployments: dict[tuple[str, str, str, str], EpisodeMetrics] = {}
    for place, plant in ((SIMULATED, simulated), (MEASURED, load_plant(options.out / WITHHELD))):
        found = compare(
            {controller.name: controller for controller in everyone}, plant=plant,
            scenarios={SCENARIO: scenario}, episodes=options.episodes, duration=options.duration,
            plant_sets=(ITSELF, AROUND), journal=Journal(folder / f"{place}.jsonl", {"place": place}),
        )  # fmt: skip
        for (plants, _, label), metrics in found.items():
            deployments[name, place, plants, label] = metrics
    return deployments


def report(deployments: Deployments, diagnosis: dict[str, Any], withheld: str, folder: Path) -> str:
    """Write sim-to-real.json, performance.csv and the picture; return what is to be printed.

    Args:
        deployments: of both stages.
        diagnosis: the content of gap.json.
        withheld: the effect of the bench's valve.
        folder: where the files are written.
    """
    from training.evaluation.plots import save_figure  # matplotlib takes a second to import: only now

    performance, gaps = performance_table(deployments), gap_table(deployments)
    content = {
        "withheld": withheld,
        "diagnosis": {key: diagnosis[key] for key in ("verdict", "causes", "ambiguity_set", "gap")},
        "aims": performance.to_dict("records"),
        "gaps": gaps.to_dict("records"),
    }
    write_json(folder / RESULT, content, allow_nan=False)
    write_text(folder / "performance.csv", performance.to_csv(index=False))
    save_figure(performance_figure(performance), folder / PICTURE)
    text = short_table(performance, gaps).to_string(index=False)
    return f"{diagnosis_text(diagnosis, withheld)}\n\n{text}"


def _identification(command: str, arguments: list[str]) -> None:
    """Run a command of the identification."""
    module = importlib.import_module(f"identification.commands.{command}")
    module.run(parse(module, command, arguments))


def _announce(step: str) -> None:
    """Say on stderr, like its progress, which step begins."""
    print(f"[{step}]", file=sys.stderr)
