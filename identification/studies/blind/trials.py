"""The first stages of a blind check in a folder: draw and commit. Each trial runs once.

trials/NNNN/campaign/    the campaign: all that the diagnosis gets, with ...
trials/NNNN/request.json ... the causes excluded from its catalogue
trials/NNNN/sealed.json, truth.npz   the truth
trials/NNNN/diagnosis/gap.json       the diagnosis (diagnoses.py)
trials/NNNN/campaign-NAME/, diagnosis-NAME/   the same of a disturbance (robustness.py)
commitments.sha256       hashes of the truths, written before the first diagnosis
"""

import json
import sys
from collections.abc import Sequence
from pathlib import Path

from epv_env.common.files import write_text
from identification.bench.session import TrueSignals
from identification.recordings.campaign_files import FILE_NAME, write_campaign
from identification.studies.blind.bench import blind_campaign, true_recordings
from identification.studies.blind.commitments import (
    LABEL_FILE,
    commitment,
    explainable_gap,
    noise_free_recordings,
    packed_recordings,
    truth_label,
    write_truth,
)
from identification.studies.blind.kinds import TWO_EFFECTS
from identification.studies.blind.processes import run_in_processes
from identification.studies.blind.settings import DEFAULTS, BlindSettings
from identification.studies.blind.truth import Trial, draw_trial, trial_plan

COMMITMENTS_FILE, STUDY_FILE, REQUEST_FILE = "commitments.sha256", "blind.json", "request.json"


def trial_folder(out: Path, number: int) -> Path:
    """Folder of a trial."""
    return out / "trials" / f"{number:04d}"


def check_study(out: Path, *, seed: int, forms: str) -> None:
    """Note the seed and the forms of a folder's trials.

    Raises:
        ValueError: the folder holds trials of another seed or of other forms.
    """
    path = out / STUDY_FILE
    study = {"seed": seed, "forms": forms}
    if path.exists():
        # A study from before there was a choice has no entry for its forms.
        earlier = {"forms": DEFAULTS.forms, **json.loads(path.read_text(encoding="utf-8"))}
        for name, given in study.items():
            if earlier[name] != given:
                raise ValueError(
                    f"{out} holds trials of {name} {earlier[name]}: give --{name} {earlier[name]}, or "
                    "another --out"
                )
    write_text(path, json.dumps(study) + "\n")


def generate(
    out: Path, *, trials: int, seed: int, workers: int, settings: BlindSettings = DEFAULTS
) -> None:
    """Draw and record every trial that is missing, and write its truth."""
    jobs = [
        (trial_folder(out, number), seed, number, kind, causes, settings)
        for number, (kind, causes) in enumerate(trial_plan(seed, trials, settings))
        if not (trial_folder(out, number) / "campaign" / FILE_NAME).exists()
    ]
    for _ in run_in_processes(generate_trial, jobs, workers=workers, label="blind: campaigns"):
        pass


def generate_trial(
    folder: Path,
    seed: int,
    number: int,
    kind: str,
    causes: Sequence[str],
    settings: BlindSettings = DEFAULTS,
) -> None:
    """Write one trial. campaign.json comes last, so an interrupted trial counts as missing.

    Raises:
        RuntimeError: no solver follows any of the valves drawn with these causes.
    """
    trial, truths, single_gaps = _drawn_and_recorded(seed, number, kind, causes, settings)
    recordings = noise_free_recordings(truths)
    content = packed_recordings(recordings)
    gap = explainable_gap(trial, recordings, settings)
    label = truth_label(trial, gap, single_gaps, recordings=content, seed=seed, settings=settings)
    write_truth(folder, label, content)
    write_text(folder / REQUEST_FILE, json.dumps({"without": list(trial.excluded)}) + "\n")
    write_campaign(blind_campaign(truths, trial, seed), folder / "campaign")


def commit(out: Path, trials: int) -> dict[int, str]:
    """Hash every label, write and print the hashes, and return them by trial.

    Raises:
        ValueError: a label has changed since an earlier commitment.
    """
    path = out / COMMITMENTS_FILE
    earlier = read_commitments(path)
    hashes = {number: commitment(trial_folder(out, number)) for number in range(trials)}
    changed = [n for n, digest in hashes.items() if earlier.get(n, digest) != digest]
    if changed:
        raise ValueError(
            f"{trial_folder(out, changed[0]) / LABEL_FILE} is not what {path} commits to: put the "
            "committed file back, or start in another folder"
        )
    text = "".join(f"{digest}  {n:04d}\n" for n, digest in sorted({**earlier, **hashes}.items()))
    write_text(path, text)
    print(f"{text}committed: {path}", flush=True)
    return hashes


def read_commitments(path: Path) -> dict[int, str]:
    """Hashes by trial; none where there is no file."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    pairs = [line.split() for line in lines]
    return {int(number): digest for digest, number in pairs}


def _drawn_and_recorded(
    seed: int, number: int, kind: str, causes: Sequence[str], settings: BlindSettings
) -> tuple[Trial, list[TrueSignals], dict[str, float]]:
    """A trial that a solver follows, its recordings, and the gaps of a pair's single effects [-]."""
    for attempt in range(settings.attempts):
        trial = draw_trial(seed, number, kind, causes, attempt, settings)
        try:
            truths = true_recordings(trial, seed, settings)
            return trial, truths, _single_gaps(trial, seed, settings)
        except RuntimeError as error:
            print(f"trial {number}: drawn anew, as {error}", file=sys.stderr, flush=True)
    raise RuntimeError(f"trial {number}: no solver follows a valve with {' and '.join(causes)}")


def _single_gaps(trial: Trial, seed: int, settings: BlindSettings) -> dict[str, float]:
    """Explainable gap of each effect of a pair without the other [-]; empty for other kinds."""
    if trial.kind != TWO_EFFECTS:
        return {}
    gaps = {}
    for effect in trial.causes:
        single = trial.with_only(effect)
        recordings = noise_free_recordings(true_recordings(single, seed, settings))
        gaps[effect] = explainable_gap(single, recordings, settings)["explainable"]
    return gaps
