"""Train on the nominal plant, deploy on a bench, diagnose, retrain, deploy again.

    epv sim-to-real --out runs/sim-to-real

The bench is a virtual one. Its valve has an effect that is withheld from every other step: training,
simulation and diagnosis see what a user sees. Finished steps in --out are kept.
"""

import sys
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

from controllers.policy_files import policy_digest
from controllers.tuned import load_tunings
from epv_env.common.command_line import NextStep, beside
from epv_env.common.extras import DISTRIBUTION
from epv_env.common.files import Journal, decoded, write_json, write_text
from epv_env.common.options import Count, Folder, JudgedSeconds, Quick, Seed
from epv_env.common.results_folder import check_options, write_options
from epv_env.plant.plantfile import Plant, load_plant, plant_subject
from identification.bench.programmes import SUITES
from identification.commands import bench
from identification.gap.report.gap_json import GAP
from training.evaluation.named import named_controllers
from training.evaluation.plots import COLOURS, save_figure
from training.evaluation.scenarios import EvaluationScenario
from training.studies.comparison import Results, as_text, compare, rows
from training.studies.sim_to_real import (
    CORRECTED,
    MEASURED,
    SCENARIO,
    SIMULATED,
    diagnosis_text,
    gap_table,
    share_picture,
    trained,
)

QUICK: dict[str, Any] = {"timesteps": 8192, "episodes": 8, "duration": 1.0, "suite": "report"}

BEFORE, AFTER = "before", "after"
"""Stages: trained on the nominal plant, retrained on the corrected one."""
REGION = "ten_percent"
"""Plants around the simulated one that PPO trains on: no wider, so that a gap is felt. Policies are
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
    quick: Quick = False


def run(options: Options) -> None:
    """The four steps, those that --out lacks; write sim-to-real.json, performance.csv and the picture.

    Raises ValueError for a folder that was begun with other options, or an effect that cannot be used.
    """
    from identification.commands import gap  # with the extra `identification`

    out = options.out
    settings = {name: v for name, v in asdict(options).items() if name not in ("out", "quick")}
    settings["software"] = version(DISTRIBUTION)
    check_options(out, settings, "sim-to-real run")
    print("[1 of 4: the bench records its valve]", file=sys.stderr)
    recording = bench.Options(
        suite=options.suite, effect=[options.effect], seed=options.seed,
        out=out / CAMPAIGN, truth=out / WITHHELD,
    )  # fmt: skip
    bench.true_parameters(recording, load_plant(None))  # refuses an effect that cannot be used
    write_options(out, settings)  # before what it belongs to: a run may stop anywhere
    if not (out / WITHHELD).exists():
        bench.run(recording)
    print("[2 of 4: train on the nominal plant, deploy]", file=sys.stderr)
    results = deployed(BEFORE, load_plant(None), options)
    print("[3 of 4: diagnose the campaign]", file=sys.stderr)
    if not (out / DIAGNOSIS / GAP).exists():  # written last, after the corrected plant
        gap.run(gap.Options(out / CAMPAIGN, out=out / DIAGNOSIS, seed=options.seed))
    print("[4 of 4: train on the corrected plant, deploy]", file=sys.stderr)
    results |= deployed(AFTER, load_plant(out / DIAGNOSIS / CORRECTED), options)
    report(results, options)


def next_step(options: Options) -> NextStep:
    """Compare the two policies on the bench's valve."""
    policies = [f"{name}={options.out / name}" for name in (BEFORE, AFTER)]
    words = ("compare", "--controllers", *policies, "--out", beside(options.out, "comparison"))
    return NextStep("to compare both policies on the bench's valve", words, options.out / WITHHELD)


def deployed(stage: str, simulated: Plant, options: Options) -> Results:
    """Train on the simulated plant, then deploy in simulation and on the bench's valve.

    The classic controllers keep their tuning for the nominal plant.
    """
    folder, training = options.out / stage, {"seed": options.seed, "timesteps": options.timesteps}
    policy = trained(folder, simulated, REGION, **training)
    classic, digests = named_controllers(list(load_tunings()), Plant.calibrated())
    controllers = {policy.name: policy, **classic}
    digests[policy.name] = policy_digest(folder)
    scenario = EvaluationScenario(options={"scenario": SCENARIO})
    plants = {SIMULATED: simulated, MEASURED: load_plant(options.out / WITHHELD)}
    about = {place: plant_subject(plant) for place, plant in plants.items()}
    journal = Journal(folder / "deployments.jsonl", {**about, "duration": options.duration})
    results: Results = {}
    for place, plant in plants.items():
        results |= compare(
            controllers, plant=plant, scenarios={f"{stage}, {place}": scenario},
            episodes=options.episodes, duration=options.duration, plant_sets=("calibrated", REGION),
            journal=journal, digests=digests,
        )  # fmt: skip
    return results


def report(results: Results, options: Options) -> None:
    """Write the files of results, and print what they say of the valve itself."""
    out, performance, gaps = options.out, rows(results), gap_table(results)
    diagnosis = decoded(out / DIAGNOSIS / GAP, remedy=f"remove {out / DIAGNOSIS}")
    content = {
        "withheld": options.effect,
        "diagnosis": {key: diagnosis[key] for key in ("verdict", "causes", "ambiguity_set", "gap")},
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
