"""A blind check in a folder: draw, commit, diagnose, and only then open and score. Each trial runs once.

trials/NNNN/campaign/    the campaign: all that the diagnosis gets, with ...
trials/NNNN/request.json ... the causes struck from its catalogue
trials/NNNN/sealed.json  the truth
trials/NNNN/diagnosis/gap.json       the diagnosis
commitments.sha256       hashes of the truths, written before the first diagnosis
results.json, reliability.png   the scores (report.py)
"""

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from epv_env.common.files import write_json, write_text
from epv_env.common.results_folder import progress
from identification.bench.session import TrueSignals
from identification.blind.bench import blind_campaign, true_recordings
from identification.blind.explainable import explainable_gap
from identification.blind.score import TrialScore, score_trial
from identification.blind.sealing import (
    LABEL_FILE,
    commit,
    open_label,
    trial_folder,
    truth_label,
)
from identification.blind.truth import TWO_EFFECTS, Trial, draw_trial, trial_plan
from identification.recordings.campaign_files import FILE_NAME, write_campaign

STUDY_FILE, REQUEST_FILE, DIAGNOSIS_FILE = "blind.json", "request.json", "gap.json"

ATTEMPTS = 5
"""Draws of a trial with the same causes before the check gives up [-]."""


def blind_scores(
    out: Path,
    *,
    trials: int,
    seed: int,
    workers: int,
    diagnosis: Callable[..., object],
    forms: str = "usual",
) -> list[TrialScore]:
    """Run the missing parts of a blind check, and score every trial.

    Args:
        out: folder of the trials.
        trials: number of trials.
        seed: of truths and noise.
        workers: processes.
        diagnosis: reads a campaign's folder and writes gap.json into another one: called as
            diagnosis(campaign, out, without=causes, report=False), without those causes in its
            catalogue. A function of a module, as other processes import it by name.
        forms: of FORM_DEVIATIONS.

    Raises:
        ValueError: the folder holds trials of another seed or of other forms, or a committed truth was
            changed.
    """
    check_study(out, seed=seed, forms=forms)
    _generate(out, trials=trials, seed=seed, workers=workers, forms=forms)
    committed = commit(out, trials)
    _diagnose(out, trials=trials, workers=workers, diagnosis=diagnosis)
    return [
        score_trial(
            open_label(trial_folder(out, number), committed[number]),
            read_diagnosis(trial_folder(out, number)),
        )
        for number in range(trials)
    ]


def check_study(out: Path, *, seed: int, forms: str) -> None:
    """Note the seed and the forms of a folder's trials.

    Raises:
        ValueError: the folder holds trials of another seed or of other forms.
    """
    path = out / STUDY_FILE
    study = {"seed": seed, "forms": forms}
    earlier = json.loads(path.read_text(encoding="utf-8")) if path.exists() else study
    for name, given in study.items():
        if earlier[name] != given:
            raise ValueError(
                f"{out} holds trials of {name} {earlier[name]}: give --{name} {earlier[name]}, or "
                "another --out"
            )
    write_text(path, json.dumps(study) + "\n")


def read_diagnosis(folder: Path) -> dict[str, Any] | None:
    """Content of a trial's gap.json; None without one."""
    path = folder / "diagnosis" / DIAGNOSIS_FILE
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def generate_trial(
    folder: Path, seed: int, number: int, kind: str, causes: Sequence[str], forms: str
) -> None:
    """Write one trial. campaign.json comes last, so an interrupted trial counts as missing.

    Raises:
        RuntimeError: no solver follows any of the valves drawn with these causes.
    """
    trial, truths, single_gaps = _drawn_and_recorded(seed, number, kind, causes, forms)
    label = truth_label(trial, explainable_gap(trial, truths), single_gaps, seed=seed)
    write_json(folder / LABEL_FILE, label, allow_nan=False)
    write_text(folder / REQUEST_FILE, json.dumps({"without": list(trial.excluded)}) + "\n")
    write_campaign(blind_campaign(truths, trial, seed), folder / "campaign")


def _generate(out: Path, *, trials: int, seed: int, workers: int, forms: str) -> None:
    """Draw and record every trial that is missing, and write its truth."""
    jobs = [
        (trial_folder(out, number), seed, number, kind, causes, forms)
        for number, (kind, causes) in enumerate(trial_plan(seed, trials))
        if not (trial_folder(out, number) / "campaign" / FILE_NAME).exists()
    ]
    for _ in _in_processes(generate_trial, jobs, workers=workers, label="blind: campaigns"):
        pass


def _drawn_and_recorded(
    seed: int, number: int, kind: str, causes: Sequence[str], forms: str
) -> tuple[Trial, list[TrueSignals], dict[str, float]]:
    """A trial that a solver follows, its recordings, and the gaps of a pair's single effects [-]."""
    for attempt in range(ATTEMPTS):
        trial = draw_trial(seed, number, kind, causes, forms, attempt)
        try:
            return trial, true_recordings(trial, seed), _single_gaps(trial, seed)
        except RuntimeError as error:
            print(f"trial {number}: drawn anew, as {error}", file=sys.stderr, flush=True)
    raise RuntimeError(f"trial {number}: no solver follows a valve with {' and '.join(causes)}")


def _single_gaps(trial: Trial, seed: int) -> dict[str, float]:
    """Explainable gap of each effect of a pair without the other [-]; empty for other kinds."""
    if trial.kind != TWO_EFFECTS:
        return {}
    singles = {effect: trial.with_only(effect) for effect in trial.causes}
    return {
        effect: explainable_gap(single, true_recordings(single, seed))
        for effect, single in singles.items()
    }


def _diagnose(out: Path, *, trials: int, workers: int, diagnosis: Callable[..., object]) -> None:
    """Diagnose every trial that has no diagnosis yet, in processes that get the campaign only."""
    jobs = []
    for folder in (trial_folder(out, number) for number in range(trials)):
        if not (folder / "diagnosis" / DIAGNOSIS_FILE).exists():
            without = json.loads((folder / REQUEST_FILE).read_text(encoding="utf-8"))["without"]
            jobs.append((diagnosis, folder / "campaign", folder / "diagnosis", without))
    for failure in _in_processes(_diagnose_trial, jobs, workers=workers, label="blind: diagnoses"):
        if failure:
            print(failure, file=sys.stderr, flush=True)


def _diagnose_trial(
    diagnosis: Callable[..., object], campaign: Path, out: Path, without: Sequence[str]
) -> str | None:
    """Run one diagnosis. Returns a message if the diagnosis fails: the trial then has none."""
    try:
        diagnosis(campaign, out, without=without, report=False)
    except Exception as error:  # one failure must not end the study; it is shown and scored
        return f"{campaign}: the diagnosis failed: {type(error).__name__}: {error}"
    return None


def _in_processes(
    function: Callable[..., Any], jobs: Sequence[tuple], *, workers: int, label: str
) -> Iterator[Any]:
    """Results of a function for the arguments of each job, as they are completed."""
    if not jobs:
        return
    # Threads of two workers' linear algebra would wait for each other.
    pool = ProcessPoolExecutor(
        min(workers, len(jobs)), get_context("spawn"), initializer=threadpool_limits, initargs=(1,)
    )
    try:
        futures = [pool.submit(function, *job) for job in jobs]
        for future in progress(as_completed(futures), what=label, total=len(jobs)):
            yield future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
