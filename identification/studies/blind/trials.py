"""The stages of a blind check in a folder: draw and seal, commit, diagnose. Each trial once.

trials/NNNN/campaign/    all that a diagnosing process is told of, with ...
trials/NNNN/request.json ... the causes struck from its catalogue
trials/NNNN/sealed.json, truth.npz   the answer
trials/NNNN/diagnosis/gap.json       what it said
commitments.sha256       hashes of the sealed answers, written before the first diagnosis
"""

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Protocol

from threadpoolctl import threadpool_limits

from epv_env.common.files import write_text
from epv_env.common.progress import progress
from identification.recordings.campaign_files import write_campaign
from identification.recordings.manifest import FILE_NAME
from identification.studies.blind.bench import blind_campaign, true_recordings
from identification.studies.blind.commitments import (
    LABEL,
    commitment,
    explainable,
    label,
    noise_free,
    packed,
    write_sealed,
)
from identification.studies.blind.truth import PAIR, Trial, draw_trial, plan

COMMITMENTS, STUDY, REQUEST, ANSWER = "commitments.sha256", "blind.json", "request.json", "gap.json"


ATTEMPTS = 5


class Diagnosis(Protocol):
    """What a trial asks of a diagnosis: read the campaign, write `out`/gap.json."""

    def __call__(
        self, campaign: Path, out: Path, *, without: Sequence[str] = (), report: bool = False
    ) -> object: ...


def trial_folder(out: Path, number: int) -> Path:
    """Where a trial lies."""
    return out / "trials" / f"{number:04d}"


def check_study(out: Path, seed: int) -> None:
    """A folder holds trials of one seed. Raises ValueError for another."""
    path = out / STUDY
    if path.exists():
        found = json.loads(path.read_text(encoding="utf-8"))["seed"]
        if found != seed:
            raise ValueError(
                f"{out} holds trials of seed {found}: give --seed {found}, or another --out"
            )
    write_text(path, json.dumps({"seed": seed}) + "\n")


def generate(out: Path, *, trials: int, seed: int, workers: int) -> None:
    """Draw, record and seal every trial that is not there yet."""
    jobs = [
        (trial_folder(out, number), seed, number, kind, causes)
        for number, (kind, causes) in enumerate(plan(seed, trials))
        if not (trial_folder(out, number) / "campaign" / FILE_NAME).exists()
    ]
    for _ in in_processes(generate_trial, jobs, workers=workers, what="blind: campaigns"):
        pass


def generate_trial(folder: Path, seed: int, number: int, kind: str, causes: Sequence[str]) -> None:
    """One trial; its campaign.json comes last, so that a part of a trial is none.

    Raises RuntimeError if no solver follows any of ATTEMPTS valves with these causes.
    """
    for attempt in range(ATTEMPTS):
        trial = draw_trial(seed, number, kind, causes, attempt)
        try:
            truths = true_recordings(trial, seed)
            alone = _alone(trial, seed)
            break
        except RuntimeError as error:
            print(f"trial {number}: drawn anew, as {error}", file=sys.stderr, flush=True)
    else:
        raise RuntimeError(f"trial {number}: no solver follows a valve with {' and '.join(causes)}")
    recordings = noise_free(truths)
    truth = packed(recordings)
    content = label(trial, explainable(trial, recordings), alone, truth=truth, seed=seed)
    write_sealed(folder, content, truth)
    write_text(folder / REQUEST, json.dumps({"without": list(trial.struck)}) + "\n")
    write_campaign(blind_campaign(truths, trial, seed), folder / "campaign")


def commit(out: Path, trials: int) -> dict[int, str]:
    """Hash every label, keep the list, print it. Raises ValueError if a label has changed since."""
    path = out / COMMITMENTS
    earlier = read_commitments(path)
    found = {number: commitment(trial_folder(out, number)) for number in range(trials)}
    changed = [n for n, digest in found.items() if earlier.get(n, digest) != digest]
    if changed:
        raise ValueError(
            f"{trial_folder(out, changed[0]) / LABEL} is not what {path} commits to: put the sealed "
            "file back, or start in another folder"
        )
    text = "".join(f"{digest}  {n:04d}\n" for n, digest in sorted({**earlier, **found}.items()))
    write_text(path, text)
    print(f"{text}committed: {path}", flush=True)
    return found


def read_commitments(path: Path) -> dict[int, str]:
    """Hashes by trial; none where there is no file."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    pairs = [line.split() for line in lines]
    return {int(number): digest for digest, number in pairs}


def diagnose(out: Path, *, trials: int, workers: int, diagnosis: Diagnosis) -> None:
    """Have every trial diagnosed that has no answer yet, by processes that get its campaign only."""
    folders = [trial_folder(out, number) for number in range(trials)]
    jobs = [
        (diagnosis, folder / "campaign", folder / "diagnosis", _without(folder))
        for folder in folders
        if not (folder / "diagnosis" / ANSWER).exists()
    ]
    for failure in in_processes(diagnose_trial, jobs, workers=workers, what="blind: diagnoses"):
        if failure:
            print(failure, file=sys.stderr, flush=True)


def diagnose_trial(
    diagnosis: Diagnosis, campaign: Path, out: Path, without: Sequence[str]
) -> str | None:
    """One diagnosis. Returns what went wrong, if anything: without an answer the trial is missed."""
    try:
        diagnosis(campaign, out, without=without, report=False)
    except Exception as error:  # one failure must not end the study; it is shown and scored
        return f"{campaign}: the diagnosis failed: {type(error).__name__}: {error}"
    return None


def answer_of(folder: Path) -> dict[str, Any] | None:
    """A trial's gap.json; None without one."""
    path = folder / "diagnosis" / ANSWER
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def in_processes(
    function: Callable[..., Any], jobs: Sequence[tuple], *, workers: int, what: str
) -> Iterator[Any]:
    """Results of a function for each of the jobs, in the order in which they come."""
    if not jobs:
        return
    pool = ProcessPoolExecutor(
        min(workers, len(jobs)), get_context("spawn"), initializer=threadpool_limits, initargs=(1,)
    )
    try:
        futures = [pool.submit(function, *job) for job in jobs]
        for future in progress(as_completed(futures), what=what, total=len(jobs)):
            yield future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _alone(trial: Trial, seed: int) -> dict[str, float]:
    """Explainable gap of each effect of a pair without the other."""
    if trial.kind != PAIR:
        return {}
    found = {}
    for effect in trial.effects:
        single = trial.with_only(effect)
        found[effect] = explainable(single, noise_free(true_recordings(single, seed)))["explainable"]
    return found


def _without(folder: Path) -> tuple[str, ...]:
    return tuple(json.loads((folder / REQUEST).read_text(encoding="utf-8"))["without"])
