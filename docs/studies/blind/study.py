"""How often the diagnosis is right on campaigns whose cause is sealed.

    python -m docs.studies.blind.study --seed 7

draws truths, records campaigns on a bench of its own, commits to the truths, diagnoses the campaigns
blind, and only then opens the truths and scores. It writes results-FORMS.json and a
table of README.md. Trials are kept in runs/blind/CODE/FORMS-SEED and not repeated:

    NNNN/campaign/          all that the diagnosis gets
    NNNN/sealed.json        the truth
    NNNN/diagnosis/gap.json the diagnosis
    commitments.sha256      hashes of the truths, written before the first diagnosis
"""

import hashlib
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from docs.studies.blind.bench import SUITE, blind_campaign, true_recordings
from docs.studies.blind.explainable import explainable_gap
from docs.studies.blind.score import figures, score_trial
from docs.studies.blind.truth import (
    EXCLUDED_EFFECT,
    FORM_DEVIATIONS,
    TWO_EFFECTS,
    Trial,
    draw_trial,
    trial_plan,
)
from docs.studies.common import PAGE, fill, study_options, study_parser, table
from epv_env.common.command_line import fail_clearly
from epv_env.common.files import write_json, write_text
from epv_env.common.options import COUNT, SEED
from epv_env.common.results_folder import progress
from epv_env.plant.valves import available_cores
from identification.bench.programmes import Programme
from identification.gap.report.gap_json import GAP
from identification.recordings.campaign_files import FILE_NAME, write_campaign
from identification.valve_gap.diagnose import diagnose_campaign

FOLDER = Path(__file__).parent
TRIALS, QUICK = 300, 2
"""Campaigns."""
QUICK_SUITE = tuple(p for p in SUITE if p.name in ("test1", "validation", "low_supply"))
"""Recordings of a campaign under --quick."""
CAMPAIGN, DIAGNOSIS, LABEL, COMMITMENTS = "campaign", "diagnosis", "sealed.json", "commitments.sha256"
EXPLAINABLE = 1.02
"""Noise-free gap after recalibration below which nothing is left to explain [-]; `no_gap` is then the
correct verdict."""
AT_LEAST = {
    "Truth in the ambiguity set": {"usual": 0.96, "strong": 0.92},
    "First cause right (a tie counts as wrong)": {"usual": 0.92, "strong": 0.85},
    "Component right": {"usual": 0.97, "strong": 0.95},
    "Effect struck from the catalogue: not `known`": {"usual": 0.9, "strong": 0.9},
}
AT_MOST = {
    "False alarms without an effect": {"usual": 0.0},
    "Calibration error of the first cause": {"usual": 0.05, "strong": 0.05},
    "Mean size of the ambiguity set": {"usual": 1.5, "strong": 1.5},
    "Seconds per diagnosis": {"usual": 60.0, "strong": 60.0},
}
"""What is asked of the figures, by forms."""


def scores(
    folder: Path, *, trials: int, seed: int, forms: str, suite: Sequence[Programme] = SUITE
) -> list[dict[str, Any]]:
    """Run the missing parts of a check, and score every trial.

    seed: of truths and noise. forms: of FORM_DEVIATIONS. Raises ValueError where a committed truth was
    changed.
    """
    plan = trial_plan(seed, trials)
    folders = [folder / f"{number:04d}" for number in range(trials)]
    new = [
        (own, seed, number, *plan[number], forms, suite)
        for number, own in enumerate(folders)
        if not (own / CAMPAIGN / FILE_NAME).exists()
    ]
    in_processes(generate_trial, new, what="blind: campaigns")
    committed = commit(folder, folders)
    unknown = [
        (own / CAMPAIGN, own / DIAGNOSIS, causes if kind == EXCLUDED_EFFECT else ())
        for own, (kind, causes) in zip(folders, plan, strict=True)
        if not (own / DIAGNOSIS / GAP).exists()
    ]
    in_processes(diagnose, unknown, what="blind: diagnoses")
    found = []
    for own, digest in zip(folders, committed, strict=True):
        answer = own / DIAGNOSIS / GAP
        said = json.loads(answer.read_text(encoding="utf-8")) if answer.exists() else None
        found.append(score_trial(open_label(own, digest), said))
    return found


def in_processes(function: Callable[..., None], jobs: Sequence[tuple], *, what: str) -> None:
    """Call a function with the arguments of each job."""
    with ProcessPoolExecutor(available_cores(), get_context("spawn"), threadpool_limits, (1,)) as pool:
        for _ in progress(pool.map(function, *zip(*jobs, strict=True)), what=what, total=len(jobs)):
            pass


def generate_trial(
    folder: Path,
    seed: int,
    number: int,
    kind: str,
    causes: Sequence[str],
    forms: str,
    suite: Sequence[Programme],
) -> None:
    """Write one trial. campaign.json comes last, so an interrupted trial counts as missing.

    Raises RuntimeError where no solver follows any of the valves drawn with these causes.
    """
    for attempt in range(5):
        trial = draw_trial(seed, number, kind, causes, forms, attempt)
        try:
            truths = true_recordings(trial, seed, suite)
            alone = {
                effect: explainable_gap(half, true_recordings(half, seed, suite))
                for effect in (causes if kind == TWO_EFFECTS else ())
                for half in [trial.with_only(effect)]
            }
        except RuntimeError as error:
            print(f"trial {number}: drawn anew, as {error}", file=sys.stderr, flush=True)
            continue
        label = truth_label(trial, explainable_gap(trial, truths), alone, seed=seed)
        write_json(folder / LABEL, label, allow_nan=False)
        write_campaign(blind_campaign(truths, trial, seed), folder / CAMPAIGN)
        return
    raise RuntimeError(f"trial {number}: no solver follows a valve with {' and '.join(causes)}")


def truth_label(trial: Trial, gap: float, alone: Mapping[str, float], *, seed: int) -> dict[str, Any]:
    """The content of sealed.json, JSON-ready.

    `visible`: causes that leave something to explain; both of a pair that only together do.

    gap: of `explainable_gap` [-]. alone: the same of each effect of a pair alone [-]. seed: of the salt.
    """
    causes = list(trial.causes)
    visible = [c for c in causes if alone.get(c, gap) >= EXPLAINABLE] or causes
    return {
        "format": "epv-blind/4",
        "trial": trial.number,
        "kind": trial.kind,
        "effects": causes,
        "visible": visible if gap >= EXPLAINABLE else [],
        "sizes": trial.sizes,
        "deviation": trial.form_deviation,
        "other_forms": list(trial.other_forms),
        "warmest_K": trial.winding_temperature_rise,
        "parameters": dict(trial.parameters),
        "gap": {"explainable": gap},
        "gap_alone": dict(alone),
        # So that the hash tells nothing of the content.
        "salt": np.random.default_rng([seed, trial.number, 0, 5]).bytes(16).hex(),
    }


def commit(folder: Path, trials: Sequence[Path]) -> list[str]:
    """Hash every trial's label, write and print the hashes, and return them.

    `sha256sum -c` reads the file. Raises ValueError where a label has changed since it was committed.
    """
    path = folder / COMMITMENTS
    lines = [f"{_hash(trial)}  {trial.name}/{LABEL}" for trial in trials]
    earlier = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    for trial, line, before in zip(trials, lines, earlier, strict=False):
        if line != before:
            raise ValueError(
                f"{trial / LABEL} is not what {path} commits to: put the committed file back, or remove "
                f"{folder}"
            )
    write_text(path, "\n".join([*lines, *earlier[len(lines) :]]) + "\n")
    print("\n".join(lines), f"committed: {path}", sep="\n", flush=True)
    return [line.split()[0] for line in lines]


def open_label(trial: Path, committed: str) -> dict[str, Any]:
    """A trial's label, opened. Raises ValueError where its hash is another than committed."""
    if _hash(trial) != committed:
        raise ValueError(
            f"{trial / LABEL} is not what was committed to before the diagnosis (SHA-256 "
            f"{committed[:12]}..): put the committed file back, or remove {trial.parent}"
        )
    return json.loads((trial / LABEL).read_text(encoding="utf-8"))


def _hash(trial: Path) -> str:
    """SHA-256 of a trial's label, hexadecimal."""
    return hashlib.sha256((trial / LABEL).read_bytes()).hexdigest()


def diagnose(campaign: Path, out: Path, without: Sequence[str]) -> None:
    """Run one diagnosis; one that fails writes nothing, and its message is shown."""
    try:
        diagnose_campaign(campaign, out, without=without, report=False)
    except Exception as error:  # one failure must not end the study
        print(f"{campaign}: {type(error).__name__}: {error}", file=sys.stderr, flush=True)


def rows(found: Mapping[str, Mapping[str, Any]], forms: str) -> list[list[str]]:
    """Name, result and what is asked of each of `figures`; a result that misses it is bold."""
    cells = []
    for name, figure in found.items():
        least, most = (asked.get(name, {}).get(forms) for asked in (AT_LEAST, AT_MOST))
        number = "-"
        if (value := figure["value"]) is not None:
            missed = (least is not None and value < least) or (most is not None and value > most)
            number = f"**{value:.3g}**" if missed else f"{value:.3g}"
        hits = f"{figure['hits']} of {figure['of']}: " if "of" in figure else ""
        interval = f" ({figure['low']:.2g} to {figure['high']:.2g})" if "low" in figure else ""
        asked = f"at least {least:g}" if least else "" if most is None else f"at most {most:g}"
        cells.append([name, f"{hits}{number}{interval}", asked])
    return cells


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    parser = study_parser(__doc__ or "", FOLDER)
    parser.add_argument("--trials", type=COUNT, default=TRIALS, help="number of campaigns")
    parser.add_argument("--seed", type=SEED, default=0, help="of truths and noise")
    ranges = [f"{name} {100 * a:.0f} to {100 * b:.0f} %%" for name, (a, b) in FORM_DEVIATIONS.items()]
    parser.add_argument(
        "--forms",
        choices=FORM_DEVIATIONS,
        default="usual",
        help=f"how far the effects' forms are from the fitted ones: {'; '.join(ranges)}",
    )
    options = study_options(parser, arguments)
    count, suite = (QUICK, QUICK_SUITE) if options.quick else (options.trials, SUITE)
    forms, seed = options.forms, options.seed
    folder = options.work / f"{forms}-{seed}"
    found = scores(folder, trials=count, seed=seed, forms=forms, suite=suite)
    counted = figures(found)
    results = {"seed": seed, "forms": forms, "figures": counted, "each": found}
    write_json(options.out / f"results-{forms}.json", results, allow_nan=False)
    heads = ("Measured", "Result (95 % interval)", "Asked")
    part = f"Seed {seed}, {count} trials.\n\n{table(heads, rows(counted, forms))}"
    fill(options.out / PAGE, {forms: part})
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
