"""Estimate how rarely an episode leaves target ±500 mbar, by splitting, with an interval.

    epv rare --controller "adaptive pulse" --region ten-percent --out runs/rare

Repetitions that are finished are kept in --out and not run again. Beside the probability it writes the
probabilities of smaller excursions, and a picture of the episodes that leave: plants and applications.
"""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from epv_env.common.command_line import NextStep
from epv_env.common.files import Journal, write_json, write_text
from epv_env.common.options import Device, Folder, JudgedSeconds, Number, PlantFile, Quick, Seed
from epv_env.plant.plantfile import load_plant, plant_subject
from epv_env.reward import BAND_BAR
from epv_env.vector_entry import check_device
from training.evaluation.batches import run_jobs
from training.evaluation.named import HELP, SHIPPED, named_controllers
from training.evaluation.plots import save_figure
from training.evaluation.scenarios import EVALUATION, RANDOM
from training.rare.episodes import Episodes
from training.rare.report import plain_episodes, rare_figure, tail
from training.rare.splitting import CHAIN, Problem
from training.studies.comparison import plant_region

REGIONS = {"confidence": "confidence", "ten-percent": "sensitive_ten_percent"}
"""Plants by what a user calls them."""
QUICK: dict[str, Any] = {
    "out": Path("runs/quick-rare"), "particles": 16, "repetitions": 2, "duration": 1.0, "least": 0.05,
}  # fmt: skip
KEPT = 4
"""Rare episodes of a repetition that are described."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """The controller, the plants, and how long to look."""

    out: Folder = Path("runs/rare")
    controller: Annotated[str, HELP] = SHIPPED
    region: Annotated[str, {"choices": tuple(REGIONS)}, "plants"] = "ten-percent"
    particles: Annotated[int, Number(int, 2 * CHAIN, 10**6), "episodes of a level"] = 2048
    repetitions: Annotated[int, Number(int, 2, 10**4), "independent estimates"] = 10
    least: Annotated[float, Number(float, 1e-12, 0.5), "probability to search down to"] = 1e-8
    duration: JudgedSeconds = 10.0
    seed: Annotated[Seed, "of the random numbers behind all episodes"] = 0
    plant: PlantFile = None
    workers: Annotated[int | None, Number(int, 1, 1024), "processes (default: all cores)"] = None
    device: Device = "cpu"
    quick: Quick = False


def run(options: Options) -> None:
    """Run the repetitions that --out lacks; write results.json, tail.csv and rare.png.

    Raises ValueError for an unknown controller.
    """
    check_device(options.device)
    plant = load_plant(options.plant)
    controllers, digests = named_controllers([options.controller], plant)
    ((label, controller),) = controllers.items()
    names = ("region", "particles", "least", "duration", "seed")
    settings = {**{name: getattr(options, name) for name in names}, "controller": digests[label]}
    episodes = Episodes(
        controller=controller, duration=options.duration,
        options={
            "plant": plant, "parameters": plant_region(REGIONS[options.region], plant),
            **EVALUATION[RANDOM].options,
        },
        device=options.device,
    )  # fmt: skip
    problem = Problem(
        level=episodes.worst, moves=episodes.moves, particles=options.particles // CHAIN * CHAIN
    )
    journal = Journal(options.out / "finished.jsonl", {**plant_subject(plant), **settings})
    work = {"journal": journal, "workers": options.workers if options.device == "cpu" else 1}
    pilot = partial(
        problem.thresholds, BAND_BAR, options.least, np.random.default_rng([options.seed, 0])
    )
    (thresholds,) = run_jobs({"thresholds": pilot}, what="thresholds", **work)
    jobs = {
        f"repetition {k}": partial(repetition, problem, episodes, thresholds, [options.seed, k])
        for k in range(1, options.repetitions + 1)
    }
    found = run_jobs(jobs, what="repetitions", **work)
    table = tail(thresholds, found)
    write_text(options.out / "tail.csv", table.to_csv(index=False))
    result = {
        "format": "epv-rare/1",
        "label": label,
        "settings": settings,
        **summary(thresholds, found, options.least),
    }
    rare = [episode for each in found for episode in each["rare"]]
    write_json(options.out / "results.json", {**result, "episodes": rare})
    if rare:
        save_figure(rare_figure(rare, options.duration), options.out / "rare.png")
    print(f"{table.to_string(index=False)}\n\n{sentence(result)}\nresults in {options.out}")


def repetition(
    problem: Problem, episodes: Episodes, thresholds: list[float], seed: list[int]
) -> dict[str, Any]:
    """One repetition, ready for JSON: shares, runs, and some of its rare episodes described."""
    found = problem.repetition(thresholds, np.random.default_rng(seed))
    rare = np.unique(found.rare, axis=0)[:KEPT]
    described = episodes.described(rare) if len(rare) else []
    return {"shares": found.shares, "runs": found.runs, "rare": described}


def summary(thresholds: list[float], found: list[dict[str, Any]], least: float) -> dict[str, Any]:
    """Probability of the largest excursion that was reached, its interval, and what it took.

    "stuck": the moves found no worse episodes, though the probability was not yet below `least`.
    """
    last = tail(thresholds, found).iloc[-1].to_dict()
    plain = plain_episodes(found)
    return {
        **last,
        "stuck": last["excursion_bar"] < BAND_BAR and CHAIN ** -len(thresholds) >= least,
        "runs": sum(each["runs"] for each in found),
        "plain_episodes": plain if np.isfinite(plain) else None,
    }


def sentence(result: dict[str, Any]) -> str:
    """What was found, in words."""
    interval = f"{result['low']:.2g} to {result['high']:.2g}"
    if result["stuck"]:
        return (
            f"{result['label']}: no episodes beyond {result['excursion_bar']:.3f} bar were found, which "
            "bounds nothing: give more --particles, in another --out."
        )
    if result["excursion_bar"] < BAND_BAR:
        return (
            f"{result['label']} leaves with a probability below {result['high']:.2g}: an excursion of "
            f"{result['excursion_bar']:.3f} bar has {result['probability']:.2g} ({interval})."
        )
    return f"{result['label']} leaves with a probability of {result['probability']:.2g} ({interval})."


def next_step(options: Options) -> NextStep:
    """Compare the controller with the others."""
    words = ("compare", "--controllers", options.controller)
    return NextStep("to compare it on ordinary episodes", words, options.plant)
