"""Train the PPO controller, and compare it with the classic ones.

    python training/train_ppo.py
    python training/train_ppo.py --quick

The command writes the policy's files (policy.json, policy.safetensors), the validations, the comparison
and two pictures, and ends with a verdict. A training that was stopped goes on with --resume. With
--seeds 10 it trains ten policies, validates each on 30,000 episodes, and keeps the one that leaves the
band most rarely (seeds.csv). The higher return decides between equal ones.
"""

import shutil
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
import pandas as pd

from controllers.policy import load_policy
from controllers.policy_files import CONTRACT_FILE, WEIGHTS_FILE
from epv_env.common.command_line import NextStep, beside
from epv_env.common.files import read_bytes, write_bytes, write_text
from epv_env.common.options import (
    Count,
    Folder,
    JudgedSeconds,
    Number,
    PlantFile,
    Quick,
    Seed,
)
from epv_env.common.results_folder import CONFIG, check_same, read_config, write_options
from epv_env.plant.consumption import check_scenario
from epv_env.plant.plantfile import Plant, load_plant, plant_subject
from epv_env.plant.region import DIAGNOSIS, REGIONS
from epv_env.reward import RewardWeights
from epv_env.settings import as_region
from training.evaluation.named import named_controllers
from training.evaluation.plots import in_words, plt, save_figure
from training.evaluation.scenarios import EvaluationScenario
from training.studies.comparison import PLANTS, as_text, compare, differences, figure, rows

if TYPE_CHECKING:
    from training.learners.ppo import Task

QUICK: dict[str, Any] = {
    "out": Path("runs/quick-ppo"), "timesteps": 65_536, "episodes": 16, "duration": 2.0,
}  # fmt: skip
QUICK_TRAINING: dict[str, Any] = {
    "num_envs": 64, "validation_episodes": 16, "validation_duration": 2.0,
}  # fmt: skip
QUICK_SELECTION: dict[str, Any] = {"episodes": 16, "duration": 2.0}
REGION = "sensitive_ten_percent"
"""Plants that are trained on, and on which the verdict is given, unless --parameters names others."""
RIVALS = (
    "extrapolating hysteresis with rules", "adaptive pulse with rules", "adaptive pulse", "PWM",
    "extrapolating hysteresis",
)  # fmt: skip
"""Beside the policy in the verdict's table."""
RIVAL = "adaptive pulse"
"""Whom the verdict sets the policy against: the best classic controller."""
SAME_WHEN_RESUMED = ("seed", "seeds", "plant", "scenario", "parameters", "switching_price")
"""Options that a resumed training must share with its beginning."""
OWN = (
    CONTRACT_FILE, WEIGHTS_FILE, CONFIG, "validation.csv", "comparison.csv", "comparison.png",
    "learning_curve.png", "seeds.jsonl", "seeds.csv",
)  # fmt: skip
OWN_FOLDERS = ("best", "checkpoints", "seed-*")
"""What a training writes into its folder."""
AGAIN = {"group": "again"}


@dataclass(frozen=True, kw_only=True)
class Options:
    """The training, and the comparison at its end."""

    out: Folder = Path("runs/ppo")
    timesteps: Annotated[Count, "environment steps of PPO"] = 10_000_000
    episodes: Annotated[Count, "of the comparison"] = 1024
    duration: JudgedSeconds = 10.0
    seed: Annotated[Seed, "of the training, or of the first one"] = 0
    seeds: Annotated[Count, "trainings, each with the next seed; the best policy is kept"] = 1
    plant: PlantFile = None
    scenario: Annotated[str, "consumption scenario of the training"] = "mixed"
    parameters: Annotated[str, {"choices": (*REGIONS, DIAGNOSIS)}, "plants to train on"] = REGION
    switching_price: Annotated[
        float, Number(float, 0.0, 1000.0),
        "reward's price of one switching of the coil: trades wear against pressure dips",
    ] = RewardWeights().switching  # fmt: skip
    resume: Annotated[bool, AGAIN, "go on from the folder's checkpoint"] = False
    force: Annotated[bool, AGAIN, "begin anew in a folder that holds a training already"] = False
    quick: Quick = False


def run(options: Options) -> None:
    """Train, write the policy down, compare it, and print the verdict.

    Raises ValueError for a folder that holds another training, and for options that do not fit.
    """
    plant = load_plant(options.plant)
    as_region(options.parameters, plant)  # refuses one that the plant does not have
    check_scenario(options.scenario)
    weights = RewardWeights(switching=options.switching_price)
    begin_folder(options, plant)
    write_options(options.out, configuration(options, plant))

    from training.learners.ppo import Task  # torch takes seconds to import

    task = Task(plant=plant, scenario=options.scenario, parameters=options.parameters, weights=weights)
    save_figure(learning_curve(trained(options, task)), options.out / "learning_curve.png")
    print(verdict(options, plant, weights))


def trained(options: Options, task: "Task") -> list[dict[str, float]]:
    """Train the policy, or several of which the best is kept; returns its validations."""
    from training.learners.ppo import VALIDATION_FILE, read_rows, train
    from training.learners.selection import seed_folder, train_seeds

    provenance = {"plant": task.plant.name, "switching_price": options.switching_price}
    training: dict[str, Any] = {"timesteps": options.timesteps, "provenance": provenance}
    training |= QUICK_TRAINING if options.quick else {}
    if options.seeds == 1:
        return train(task, options.out, seed=options.seed, resume=options.resume, **training)
    table = train_seeds(
        task, options.out, seeds=range(options.seed, options.seed + options.seeds),
        **training, **(QUICK_SELECTION if options.quick else {}),
    )  # fmt: skip
    print(f"\n{table.to_string(index=False, float_format='{:.3g}'.format)}")
    best = seed_folder(options.out, table["seed"].iloc[0])
    for name in (VALIDATION_FILE, WEIGHTS_FILE, CONTRACT_FILE):
        write_bytes(options.out / name, read_bytes(best / name))
    return read_rows(best)


def next_step(options: Options) -> NextStep:
    """Compare the policy on more plants; after a short run, train with the same options."""
    if options.quick:
        words = ("train", *chosen(options), "--out", beside(options.out, "full"))
        return NextStep("to train a policy", words, options.plant)
    rivals, out = (RIVAL, f"PPO={options.out}"), beside(options.out, "comparison")
    words = ("compare", "--controllers", *rivals, "--out", out)
    if options.parameters not in (*PLANTS, "exact"):
        words = (*words, "--plants", *PLANTS, options.parameters)
    return NextStep("to compare the policy on several sets of plants", words, options.plant)


def chosen(options: Options) -> tuple[object, ...]:
    """The options that make a training another than the usual one, as a command takes them."""
    values = {name: getattr(options, name) for name in SAME_WHEN_RESUMED if name != "plant"}
    changed = {name: value for name, value in values.items() if value != getattr(Options, name)}
    return tuple(
        word for name, value in changed.items() for word in (f"--{name.replace('_', '-')}", value)
    )


def begin_folder(options: Options, plant: Plant) -> None:
    """Make the folder free for a new training, or check that it holds the one to go on with.

    Raises ValueError if the folder holds another training, or none to resume.
    """
    folder: Path = options.out
    earlier = read_config(folder, dict[str, dict[str, Any]])
    if options.resume:
        if earlier is None:
            raise ValueError(f"nothing to resume in {folder}: leave --resume out")
        now = configuration(options, plant)
        same = {name: now["options"][name] for name in SAME_WHEN_RESUMED}
        begun = earlier.get("options", {})
        check_same(begun, same, f"{folder} was trained with", "resume with the same")
        if earlier.get("plant") != now["plant"]:
            raise ValueError(
                f"the plant is another than {folder} was trained with: resume with the same plant file, "
                "or choose another --out"
            )
        return
    if options.force or options.quick:
        for name in OWN:
            (folder / name).unlink(missing_ok=True)
        for name in OWN_FOLDERS:
            for each in folder.glob(name):
                shutil.rmtree(each, ignore_errors=True)
    elif earlier is not None:
        raise ValueError(
            f"{folder} holds a training: give --resume to go on, --force to begin anew, or choose "
            "another --out"
        )


def configuration(options: Options, plant: Plant) -> dict[str, Any]:
    """Options, plant and versions: what is needed to repeat the training."""
    return {
        "options": msgspec.to_builtins(options, enc_hook=str),
        "plant": plant_subject(plant)["plant"],
        "versions": {
            package: version(package)
            for package in ("epv-valve", "gymnasium", "numba", "numpy", "stable-baselines3", "torch")
        },
    }


def verdict(options: Options, plant: Plant, weights: RewardWeights) -> str:
    """Compare; write table and picture; a sentence, a table, and where the picture lies."""
    policy = load_policy(options.out, plant)
    controllers = {policy.name: policy, **named_controllers(RIVALS, plant)[0]}
    results = compare(
        controllers, plant=plant, plant_sets=[options.parameters],
        scenarios={"random": EvaluationScenario(options={"weights": weights})},
        episodes=options.episodes, duration=options.duration,
    )  # fmt: skip
    table = rows(results)
    write_text(options.out / "comparison.csv", table.to_csv(index=False))
    save_figure(figure(table), options.out / "comparison.png")
    if options.quick:
        sentence = "This was a short run that shows that all works: nothing was learnt."
    else:
        sentence = sentence_of(differences(results, RIVAL), options)
    picture = f"picture: {options.out / 'comparison.png'}"
    return f"\n{sentence}\n\n{as_text(table)}\n\n{picture}"


def sentence_of(paired: pd.DataFrame, options: Options) -> str:
    """Whether the policy is better than the RIVAL, and by what.

    paired: rows of `differences` against it.
    """
    mine = paired[paired["controller"] == "PPO"].set_index("score")
    gain = mine.loc["return"]
    left, switchings = mine.loc["violation rate [%]"], mine.loc["switchings [1/s]"]
    if gain["low"] > 0:
        judged = "is better than"
    elif gain["high"] < 0:
        judged = "is worse than"
    else:
        judged = "cannot be told from"
    return (
        f"The policy {judged} the {RIVAL!r} controller on {options.episodes} unseen episodes "
        f"(plants: {in_words(options.parameters)}): "
        f"return {gain['difference']:+.3g} ({gain['low']:+.3g} to {gain['high']:+.3g}), "
        f"violation rate {left['difference']:+.2g} percentage points, "
        f"{switchings['difference']:+.2g} switchings a second."
    )


def learning_curve(validations: list[dict[str, float]]) -> Any:
    """The validation score that selects the policy, over environment steps."""
    drawn, axes = plt.subplots(figsize=(6, 3.5), layout="constrained")
    steps = [row["timesteps"] / 1e6 for row in validations]
    axes.plot(steps, [row["score"] for row in validations], "o-")
    for row, step in zip(validations, steps, strict=True):
        left = f"{row['left']:.0f} of {row['episodes']:.0f} violate"
        axes.annotate(
            left, (step, row["score"]), xytext=(0, 8), textcoords="offset points", ha="center",
            fontsize=8, bbox={"facecolor": "white", "edgecolor": "none", "pad": 1},
        )  # fmt: skip
    axes.margins(x=0.2, y=0.2)
    axes.set_xlabel("environment steps [millions]")
    axes.set_ylabel("validation score")
    axes.grid(alpha=0.3)
    return drawn
