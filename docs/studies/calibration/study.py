"""Fit the weights of the diagnosis' probabilities on opened trials of several virtual plants.

    python -m docs.studies.calibration.study

draws trials of the valve and of three small plants, diagnoses them, and keeps what every hypothesis
looked like in trials.jsonl; what is there is not run again. From that file it fits weights.json, checks
the fit on trials that it left out, and writes reliability.png and the table of README.md.
"""

import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import log_softmax

from docs.studies.calibration.virtual_plants import draw_trial
from docs.studies.calibration.virtual_systems import SYSTEMS
from docs.studies.common import PAGE, ROOT, fill, study_options, study_parser, table
from epv_env.common.command_line import fail_clearly
from epv_env.common.files import Journal, write_json
from epv_env.common.results_folder import progress
from identification.blind.report import draw_reliability, expected_calibration_error, reliability
from identification.blind.sealing import LABEL_FILE
from identification.blind.trials import REQUEST_FILE, generate_trial
from identification.blind.truth import trial_plan
from identification.gap.diagnosis import rank_hypotheses
from identification.gap.posterior import FIGURES, log_sets
from identification.gap.verdict import Ranking
from identification.recordings.campaign_files import read_campaign
from identification.valve_gap.valve import Valve

FOLDER = Path(__file__).parent
WEIGHTS = ROOT / "identification" / "gap" / "weights.json"
STRENGTHS = ("usual", "strong")
"""Of the deviations of the laws from those assumed."""
PLANTS = ("valve", *SYSTEMS)
VALVES, OTHERS, QUICK = 50, 25, 2
"""Trials of each strength: of the valve, of each small plant, and of either under --quick."""
SEED, SEED_STRONG = 9001, 9101
"""Of the trials of the valve; each further plant has the next one."""
KEPT = 12
"""Hypotheses of a trial that are kept: the most probable, and those that are true."""
PENALTY = 0.02
"""Of squared weights [1]: next to nothing, against weights that a few trials would let grow for ever."""
FOLDS = 10


def trial_of(plant: str, strength: str, number: int) -> tuple[Ranking, list[str] | None]:
    """The ranking of a trial, and its visible causes; None: struck from the catalogue."""
    seed = (SEED if strength == "usual" else SEED_STRONG) + PLANTS.index(plant)
    if plant == "valve":
        return valve_trial(seed, number, strength)
    trial = draw_trial(plant, seed, number, strength)
    return rank_hypotheses(trial.plant), None if trial.kind == "stranger" else list(trial.causes)


def valve_trial(seed: int, number: int, strength: str) -> tuple[Ranking, list[str] | None]:
    """The same of the valve's virtual bench."""
    kind, causes = trial_plan(seed, number + 1)[number]
    with TemporaryDirectory() as folder:
        generate_trial(Path(folder), seed, number, kind, causes, strength)
        label, request = (
            json.loads((Path(folder) / name).read_text(encoding="utf-8"))
            for name in (LABEL_FILE, REQUEST_FILE)
        )
        campaign = read_campaign(Path(folder) / "campaign")
        ranking = rank_hypotheses(Valve(campaign, without=request["without"]))
    struck = request["without"] and label["visible"]
    return ranking, None if struck else label["visible"]


def collected(journal: Journal, quick: bool) -> dict[str, dict[str, Any]]:
    """What the hypotheses of every trial looked like, by name; missing trials are run, side by side."""
    trials = {
        f"{plant} {strength} {number}": (plant, strength, number)
        for number in range(QUICK if quick else VALVES)
        for strength in STRENGTHS
        for plant in (PLANTS if quick or number < OTHERS else PLANTS[:1])
    }
    missing = [name for name in trials if name not in journal]
    pool: Any = Parallel(n_jobs=-1, return_as="generator_unordered")
    jobs = (delayed(looks)(name, *trials[name]) for name in missing)
    for name, found in progress(pool(jobs), what="trials", total=len(missing)):
        journal.add(name, found)
    return {name: journal[name] for name in trials}


def looks(name: str, plant: str, strength: str, number: int) -> tuple[str, dict[str, Any]]:
    """Name of a trial, and the figures of its hypotheses, of no cause and an unknown one.

    Beside them the log of the number of sets as large, and which are true.
    """
    ranking, truth = trial_of(plant, strength, number)
    right = [truth is not None and set(each.names) == set(truth) for each in ranking.hypotheses]
    chosen = [
        i for i, each in enumerate(ranking.hypotheses) if not each.at_bound and (i < KEPT or right[i])
    ]
    rows = [*chosen, -2, -1]
    return name, {
        "figures": np.round(ranking.figures[rows], 3).tolist(),
        "sets": np.round(log_sets(ranking.problem, ranking.hypotheses)[rows], 3).tolist(),
        "right": [*(right[i] for i in chosen), truth == [], truth is None],
    }


def log_probabilities(trial: dict[str, Any], weights: NDArray) -> NDArray:
    """Of a trial's hypotheses, of no cause and an unknown one, (n + 2,)."""
    return log_softmax(np.array(trial["figures"]) @ weights - np.array(trial["sets"]))


def fitted(trials: Sequence[dict[str, Any]]) -> NDArray:
    """Weights (figures,) that make the true hypotheses most probable; trials without one say nothing."""
    told = [trial for trial in trials if any(trial["right"])]

    def loss(weights: NDArray) -> float:
        true = [np.logaddexp.reduce(log_probabilities(t, weights)[t["right"]]) for t in told]
        return PENALTY * float(weights @ weights) - float(np.sum(true))

    return minimize(loss, np.zeros(len(FIGURES)), method="BFGS").x


def left_out(trials: Mapping[str, dict[str, Any]]) -> dict[str, tuple[NDArray, NDArray]]:
    """Probabilities of each trial's hypotheses by weights fitted without it, and which are true."""
    found = {}
    for fold in range(FOLDS):
        weights = fitted([t for i, t in enumerate(trials.values()) if i % FOLDS != fold])
        for name in list(trials)[fold::FOLDS]:
            probabilities = np.exp(log_probabilities(trials[name], weights))
            found[name] = probabilities, np.array(trials[name]["right"])
    return found


def rows(judged: Mapping[str, tuple[NDArray, NDArray]]) -> list[list[str]]:
    """Of each plant and strength, and of all: number of trials, share that is right, and error."""
    groups = {
        f"{plant}, {strength}": f"{plant} {strength} " for plant in PLANTS for strength in STRENGTHS
    }
    found = []
    for title, prefix in (groups | {"all": ""}).items():
        own = [each for name, each in judged.items() if name.startswith(prefix)]
        right = np.mean([true[np.argmax(p)] for p, true in own])
        error = expected_calibration_error(*together(own))
        found.append([title, f"{len(own)}", f"{100 * right:.0f} %", f"{error:.3f}"])
    return found


def together(judged: Iterable[tuple[NDArray, NDArray]]) -> tuple[NDArray, NDArray]:
    """Probability of the most probable hypothesis of each trial, and whether it is true, (trials,)."""
    pairs = [(np.max(p), true[np.argmax(p)]) for p, true in judged]
    probabilities, right = zip(*pairs, strict=True)
    return np.array(probabilities), np.array(right)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    options = study_options(study_parser(__doc__ or "", FOLDER), arguments)
    journal = Journal(options.out / "trials.jsonl", {"figures": list(FIGURES), "seed": SEED})
    trials = collected(journal, options.quick)
    weights = dict(zip(FIGURES, fitted([*trials.values()]).round(2).tolist(), strict=True))
    write_json(options.out / "weights.json" if options.quick else WEIGHTS, {"weights": weights})
    judged = left_out(trials)
    figure = Figure(figsize=(4.5, 4), layout="constrained")
    draw_reliability(figure.subplots(), reliability(*together(judged.values())))
    figure.savefig(options.out / "reliability.png", dpi=120)
    fill(
        options.out / PAGE,
        {
            "figures": table(
                ["Trials", "Number", "Most probable hypothesis is true", "Calibration error"],
                rows(judged),
            ),
            "weights": table(list(weights), [[f"{value:.2f}" for value in weights.values()]]),
        },
    )
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
