"""The whole blind check: draw, commit, diagnose, and only then open the commitments and score."""

from pathlib import Path

from epv_env.common.results_folder import progress
from identification.report.page import Section
from identification.report.result_files import write_results
from identification.studies.blind.blind_figures import FIGURES
from identification.studies.blind.blind_section import blind_json, blind_section
from identification.studies.blind.commitments import open_commitment
from identification.studies.blind.diagnoses import DiagnosisFunction, diagnose, read_diagnosis
from identification.studies.blind.gap_reduction import rival_distance, true_gap_reduction
from identification.studies.blind.score import TrialScore, score_trial
from identification.studies.blind.settings import DEFAULTS, BlindSettings
from identification.studies.blind.trials import (
    check_study,
    commit,
    generate,
    trial_folder,
)

RESULTS = "results"
"""Name of both result files."""


def blind_check(
    out: Path,
    *,
    trials: int,
    seed: int,
    workers: int,
    diagnosis: DiagnosisFunction,
    images: Path | None = None,
    settings: BlindSettings = DEFAULTS,
) -> Section:
    """Run the missing parts of a blind check, write results.json and results.html, return the section.

    Args:
        out: folder of the trials and results.
        trials: number of trials.
        seed: of truths and noise.
        workers: processes.
        diagnosis: a function of a module, as other processes import it by name.
        images: folder for the pictures alone, for documents; None: no pictures.
        settings: of the check.

    Raises:
        ValueError: the folder holds trials of another seed or of other forms, or a committed truth was
            changed.
    """
    check_study(out, seed=seed, forms=settings.forms)
    generate(out, trials=trials, seed=seed, workers=workers, settings=settings)
    committed = commit(out, trials)
    diagnose(out, trials=trials, workers=workers, diagnosis=diagnosis)
    scores = [
        _opened_and_scored(out, number, digest, settings)
        for number, digest in progress(committed.items(), what="blind: scores", total=trials)
    ]
    section = blind_section(scores, settings)
    if images:
        images.mkdir(parents=True, exist_ok=True)
        for name, draw in FIGURES.items():
            draw(scores).savefig(images / f"{name}.png", dpi=100)
    content = blind_json(scores, seed=seed, settings=settings)
    write_results(out, RESULTS, title=section.title, sections=[section], content=content)
    return section


def _opened_and_scored(out: Path, number: int, committed: str, settings: BlindSettings) -> TrialScore:
    folder = trial_folder(out, number)
    diagnosis = read_diagnosis(folder)
    label, truth = open_commitment(folder, committed)
    distance = rival_distance(label, diagnosis, truth, settings)
    reduction = true_gap_reduction(diagnosis, truth, settings)
    return score_trial(label, diagnosis, reduction, distance, settings)
