"""Train on the nominal plant, deploy on a bench, diagnose, retrain, deploy again.

    epv sim-to-real --out runs/sim-to-real

The bench is a virtual one. Its valve has an effect that is withheld from every other step: training,
simulation and diagnosis see what a user sees. Finished steps in --out are kept.
"""

import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from controllers.base import Controller
from controllers.policy import load_policy
from controllers.policy_files import holds_policy, policy_digest
from controllers.tuned import load_tunings
from epv_env.common.command_line import NextStep, beside
from epv_env.common.extras import DISTRIBUTION
from epv_env.common.files import Journal, digest, read_json, write_json, write_text
from epv_env.common.options import Count, Folder, JudgedSeconds, Names, Quick, Seed
from epv_env.common.results_folder import check_options, write_options
from epv_env.plant.plantfile import Plant, load_plant, plant_subject
from epv_env.plant.region import Mixture
from epv_env.reward import RewardWeights
from identification.bench.programmes import SUITES
from identification.commands import bench
from identification.gap.report.gap_json import FORMAT, GAP
from identification.recordings.campaign_files import FILE_NAME, read_campaign
from training.evaluation.named import HELP, named_controllers
from training.evaluation.plots import COLOURS, plt, save_figure
from training.evaluation.scenarios import EvaluationScenario
from training.studies.comparison import Results, as_text, compare, differences, rows

SCENARIO = "mixed"
"""Consumption of trainings and deployments."""
SWITCHING_PRICE = 0.2
"""Price of a switching in the reward [1]. Below the default: at a high price, so short a training has
not learned to control yet."""

SIMULATED, MEASURED = "simulated", "measured"
"""Places: the simulation that the controller was made on, and the bench's valve."""


CORRECTED = "plant.json"
"""Plant file that a diagnosis writes."""

Mounted = Callable[[Controller], Controller]
"""Puts a policy on the bench's valve."""

QUICK: dict[str, Any] = {
    "out": Path("runs/quick-sim-to-real"), "timesteps": 8192, "episodes": 8, "duration": 1.0,
    "suite": "report",
}  # fmt: skip

BEFORE, AFTER = "before", "after"
"""Stages: trained on the nominal plant, retrained on the plants that the diagnosis holds possible."""
REGION = "ten_percent"
"""Plants around the nominal one that PPO trains on: no wider, so that a gap is felt. Policies are
deployed on the plant itself (C1, C2), and on plants of this region around it (C3)."""
MARKS = {
    f"{stage}, {place}": (marker, inside, 7)
    for stage, marker in ((BEFORE, "s"), (AFTER, "o"))
    for place, inside in ((SIMULATED, "white"), (MEASURED, COLOURS[0]))
}
"""In the picture."""
WITHHELD, CAMPAIGN, DIAGNOSIS = "withheld/plant.json", "campaign", "diagnosis"
"""The bench's valve, its recordings, and what is made of them, within the folder of results."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """The bench's valve, its recordings, the trainings and the deployments."""

    out: Folder = Path("runs/sim-to-real")
    effect: Annotated[
        str, {"metavar": "NAME=SIZE"},
        "effect of the bench's valve, withheld from the diagnosis (docs/explanation/effects.md)",
    ] = "pressure_sensor_lag=0.02,0"  # fmt: skip
    seed: Annotated[Seed, "of both trainings, sensors, diagnosis"] = 0
    timesteps: Annotated[Count, "steps of each training"] = 1_200_000
    episodes: Annotated[Count, "episodes of each deployment"] = 256
    duration: JudgedSeconds = 6.0
    suite: Annotated[str, {"choices": SUITES}, "recordings that the bench makes"] = "diagnosis"
    controllers: Annotated[Names, f"beside the policies: {HELP}"] = tuple(load_tunings())
    quick: Quick = False


def run(options: Options) -> None:
    """The steps that --out lacks; write sim-to-real.json, performance.csv and the picture.

    Raises ValueError for a folder that was begun with other options, or an effect that cannot be used.
    """
    out = options.out
    settings = {name: v for name, v in asdict(options).items() if name not in ("out", "quick")}
    settings |= {"controllers": list(options.controllers), "software": version(DISTRIBUTION)}
    check_options(out, settings, "sim-to-real run")
    recording = bench.Options(
        suite=options.suite, effect=[options.effect], seed=options.seed,
        out=out / CAMPAIGN, truth=out / WITHHELD,
    )  # fmt: skip
    truth = bench.true_parameters(recording, load_plant(None))  # refuses an effect that cannot be used
    write_options(out, settings)  # before what it belongs to: a run may stop anywhere
    if not (out / CAMPAIGN / FILE_NAME).exists():  # which the bench writes last
        print("[the bench records its valve]", file=sys.stderr)
        bench.run(recording)
    if load_plant(out / WITHHELD).parameters != truth:
        raise ValueError(
            f"{out / WITHHELD} is not the valve with {options.effect}: choose another --out"
        )
    report(loop(options), options)


def loop(options: Options, mounted: Mounted = lambda policy: policy) -> Results:
    """Train, deploy on the valve that the bench in --out has recorded, diagnose, retrain, deploy.

    mounted: of `deployed`.
    """
    from identification.commands import gap  # with the extra `identification`

    out = options.out
    results = deployed(BEFORE, load_plant(None), REGION, options, mounted)
    if not (out / DIAGNOSIS / GAP).exists():  # written last, after the corrected plant
        print("[diagnose the campaign]", file=sys.stderr)
        gap.run(gap.Options(out / CAMPAIGN, out=out / DIAGNOSIS, seed=options.seed))
    corrected = load_plant(out / DIAGNOSIS / CORRECTED)
    fitted = {r.name: r.sha256 for r in read_campaign(out / CAMPAIGN).recordings if r.role != "quality"}
    if corrected.diagnosis is None or corrected.provenance.get("recordings_sha256") != fitted:
        raise ValueError(
            f"{out / DIAGNOSIS} is no diagnosis of {out / CAMPAIGN}: {AGAIN.format(out / DIAGNOSIS)}"
        )
    return results | deployed(AFTER, corrected, "diagnosis", options, mounted)


def next_step(options: Options) -> NextStep:
    """Compare the two policies on the bench's valve."""
    policies = [f"{name}={options.out / name}" for name in (BEFORE, AFTER)]
    words = ("compare", "--controllers", *policies, "--out", beside(options.out, "comparison"))
    return NextStep("to compare both policies on the bench's valve", words, options.out / WITHHELD)


def deployed(
    stage: str, simulated: Plant, parameters: str | Mixture, options: Options, mounted: Mounted
) -> Results:
    """Train on the simulated plant, then deploy in simulation and on the bench's valve.

    The classic controllers keep their tuning for the nominal plant.

    Args:
        stage: name of the training.
        simulated: plant.
        parameters: plants around it that are trained on.
        options: of the loop.
        mounted: puts the policy on the bench's valve, where the environment does not simulate all of it.
    """
    print(f"[train and deploy: {stage}]", file=sys.stderr)
    folder = options.out / stage
    policy = trained(folder, simulated, parameters, seed=options.seed, timesteps=options.timesteps)
    classic, digests = named_controllers(options.controllers, Plant.calibrated())
    digests[policy.name] = policy_digest(folder)
    scenario = EvaluationScenario(options={"scenario": SCENARIO})
    plants = {SIMULATED: simulated, MEASURED: load_plant(options.out / WITHHELD)}
    about = {place: plant_subject(plant) for place, plant in plants.items()}
    journal = Journal(folder / "deployments.jsonl", {**about, "duration": options.duration})
    results: Results = {}
    for place, plant in plants.items():
        own = mounted(policy) if place == MEASURED else policy
        results |= compare(
            {policy.name: own, **classic}, plant=plant, scenarios={f"{stage}, {place}": scenario},
            episodes=options.episodes, duration=options.duration, plant_sets=("calibrated", REGION),
            journal=journal, digests=digests,
        )  # fmt: skip
    return results


def report(results: Results, options: Options) -> None:
    """Write the files of results, and print what they say of the valve itself."""
    out, performance, gaps = options.out, rows(results), gap_table(results)
    content = {
        "withheld": options.effect,
        "diagnosis": msgspec.to_builtins(kept_diagnosis(out / DIAGNOSIS)),
        "aims": performance.to_dict("records"),
        "gaps": gaps.to_dict("records"),
    }
    write_json(out / "sim-to-real.json", content, allow_nan=False)
    write_text(out / "performance.csv", performance.to_csv(index=False))
    itself: Any = performance[performance["plants"] == "calibrated"]
    shares = itself.pivot(index="controller", columns="scenario", values="left_percent")
    save_figure(share_picture(shares, MARKS), out / "sim-to-real.png")
    print(f"withheld: {options.effect}; diagnosis: {diagnosis_text(out / DIAGNOSIS)}\n")
    for _, stage in itself.groupby("scenario", sort=False):
        print(f"{as_text(stage)}\n")
    error: Any = gaps[(gaps["plants"] == "calibrated") & (gaps["score"] == "rms error [mbar]")]
    columns = ["stage", "controller", "difference", "low", "high"]
    print("rms error, measured minus simulated [mbar], with its 95 % interval:")
    print(error[columns].to_string(index=False, float_format=lambda value: f"{value:+.0f}"))
    print(f"\nresults in {out}")


def trained(
    folder: Path, plant: Plant, parameters: str | Mixture, *, seed: int, timesteps: int
) -> Controller:
    """PPO trained on these plants, or as it was trained before.

    Raises ValueError for the folder of another training.

    Args:
        folder: of the training.
        plant: that is simulated.
        parameters: plants around it that are trained on.
        seed: of the training.
        timesteps: environment steps of the training.
    """
    plants = digest(json.dumps([plant_subject(plant), repr(parameters)]).encode())
    about = {"plants": plants, "seed": seed, "timesteps": timesteps}
    check_options(folder, about, "policy")
    if not holds_policy(folder):
        write_options(folder, about)
        from training.learners.ppo import Task, train  # torch takes seconds to import: only now

        weights = RewardWeights(switching=SWITCHING_PRICE)
        task = Task(plant=plant, scenario=SCENARIO, parameters=parameters, weights=weights)
        provenance = {"plant": plant.name}
        train(task, folder, seed=seed, timesteps=timesteps, resume=True, provenance=provenance)
    return load_policy(folder, plant)


AGAIN = "remove {}, and the diagnosis runs again"


class KeptDiagnosis(msgspec.Struct):
    """What the report takes from gap.json."""

    verdict: str
    causes: list[Any]
    ambiguity_set: list[Any]
    gap: dict[str, Any]


def kept_diagnosis(folder: Path) -> KeptDiagnosis:
    """That of a folder of a diagnosis. Raises JSONFileError."""
    return read_json(folder / GAP, KeptDiagnosis, version=FORMAT, remedy=AGAIN.format(folder))


def diagnosis_text(folder: Path) -> str:
    """Verdict and alternatives of the diagnosis in a folder."""
    verdict, diagnosis = kept_diagnosis(folder).verdict, load_plant(folder / CORRECTED).diagnosis
    assert diagnosis is not None  # which every diagnosis writes
    best, *others = diagnosis.alternatives
    first = f"{verdict}: {best.name.replace('_', ' ')} {best.probability:.2f}"
    return first + (f", {len(others)} more" if others else "")


def gap_table(results: Results) -> pd.DataFrame:
    """Measured minus simulated: `differences` by plants, stage, controller and score.

    results: episodes by plant set, "STAGE, PLACE" and controller; those of both places are the same.
    """
    stages: Results = {}
    for (plants, scenario, controller), metrics in results.items():
        stage, place = scenario.split(", ")
        stages[plants, f"{stage}, {controller}", place] = metrics
    table = differences(stages, SIMULATED)
    table[["stage", "controller"]] = table.pop("scenario").str.split(", ", n=1, expand=True)
    return table


def share_picture(
    shares: pd.DataFrame, marks: Mapping[str, tuple[str, str, float]], *, title: str = ""
) -> Figure:
    """Violation rates [%]: a line for each row, a mark for each column.

    marks: marker, its inside's colour and its size [points], by column of `shares`. title: of the marks.
    """
    drawn, axes = plt.subplots(figsize=(7.2, 1.4 + 0.36 * len(shares)), layout="constrained")
    places = np.arange(len(shares))
    for name, (marker, inside, size) in marks.items():
        axes.plot(shares[name], places, marker, label=name, mfc=inside, mec="black", ms=size)
    axes.set_yticks(places, list(shares.index))
    axes.set(xlabel="violation rate [%]", xlim=(-2, None))
    axes.set_ylim(len(shares) - 0.5, -0.5)
    axes.grid(alpha=0.3)
    drawn.legend(title=title, ncols=5, loc="outside upper center", frameon=False)
    return drawn
