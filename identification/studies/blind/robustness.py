"""Robustness: the trials of a finished blind check, diagnosed again under a disturbance."""

from pathlib import Path

import numpy as np

from identification.recordings.campaign_files import FILE_NAME, read_campaign, write_campaign
from identification.report.page import Section
from identification.report.result_files import write_results
from identification.studies.blind.commitments import open_commitment
from identification.studies.blind.diagnoses import (
    DiagnosisFunction,
    diagnose,
    named_folder,
    read_diagnosis,
)
from identification.studies.blind.disturbances import disturbed, disturbs_recordings, told_noise
from identification.studies.blind.robustness_section import (
    PairOfScores,
    robustness_json,
    robustness_section,
)
from identification.studies.blind.score import score_trial
from identification.studies.blind.settings import DEFAULTS, BlindSettings
from identification.studies.blind.trials import (
    COMMITMENTS_FILE,
    check_study,
    read_commitments,
    trial_folder,
)


def robustness_check(
    out: Path,
    disturbance: str,
    *,
    trials: int,
    seed: int,
    workers: int,
    diagnosis: DiagnosisFunction,
    settings: BlindSettings = DEFAULTS,
) -> Section:
    """Diagnose the first trials of a study again; write robustness-NAME.json and .html.

    Args:
        out: folder of a study whose trials are diagnosed.
        disturbance: one of DISTURBANCES.
        trials: number of trials.
        seed: of the study.
        workers: processes.
        diagnosis: a function of a module, as other processes import it by name.
        settings: of the study.

    Raises:
        ValueError: the folder holds another study or fewer trials, or a committed truth was changed.
    """
    check_study(out, seed=seed, forms=settings.forms)
    committed = read_commitments(out / COMMITMENTS_FILE)
    missing = [number for number in range(trials) if number not in committed]
    if missing:
        raise ValueError(
            f"{out} holds {len(committed)} of {trials} trials: run the study without --disturb first, "
            "or give fewer --trials"
        )
    changed = disturbs_recordings(disturbance)
    if changed:
        _write_campaigns(out, disturbance, trials=trials, seed=seed, settings=settings)
    diagnose(
        out,
        trials=trials,
        workers=workers,
        diagnosis=diagnosis,
        disturbance=disturbance,
        disturbed_campaign=changed,
        noise=told_noise(disturbance),
    )
    pairs = [_scored(out, number, committed[number], disturbance, settings) for number in range(trials)]
    section = robustness_section(disturbance, pairs)
    content = robustness_json(disturbance, pairs, seed=seed)
    name = f"robustness-{disturbance}"
    write_results(out, name, title=section.title, sections=[section], content=content)
    return section


def _write_campaigns(
    out: Path, disturbance: str, *, trials: int, seed: int, settings: BlindSettings
) -> None:
    """Write every disturbed campaign that is missing."""
    for number in range(trials):
        folder = trial_folder(out, number)
        target = folder / named_folder("campaign", disturbance)
        if not (target / FILE_NAME).exists():
            drawn = int(np.random.SeedSequence([seed, number, 0, 6]).generate_state(1)[0])
            campaign = read_campaign(folder / named_folder("campaign"))
            write_campaign(disturbed(campaign, disturbance, seed=drawn, settings=settings), target)


def _scored(
    out: Path, number: int, committed: str, disturbance: str, settings: BlindSettings
) -> PairOfScores:
    folder = trial_folder(out, number)
    label, _ = open_commitment(folder, committed)
    before, after = (
        score_trial(label, read_diagnosis(folder, name), None, settings=settings)
        for name in ("", disturbance)
    )
    return PairOfScores(before=before, after=after)
