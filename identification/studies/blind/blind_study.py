"""The whole blind check: draw and seal, commit, diagnose, and only then open and score."""

from pathlib import Path

from epv_env.common.progress import progress
from identification.report.page import Section
from identification.report.result_files import write_results
from identification.studies.blind import blind_figures as figures
from identification.studies.blind.blind_section import blind_json, blind_section
from identification.studies.blind.commitments import opened
from identification.studies.blind.score import Scored, rival_distance, scored, true_shrink
from identification.studies.blind.trials import (
    Diagnosis,
    answer_of,
    check_study,
    commit,
    diagnose,
    generate,
    trial_folder,
)

RESULTS = "results"

PICTURES = {
    "blind-detection": figures.detection,
    "blind-components": figures.components,
    "blind-causes": figures.causes,
}
"""Drawn for `images`."""


def blind_check(
    out: Path,
    *,
    trials: int,
    seed: int,
    workers: int,
    diagnosis: Diagnosis,
    images: Path | None = None,
) -> Section:
    """Run what is missing of a blind check, write results.json and results.html, return the section.

    images: folder for the pictures alone, for documents. diagnosis: a function of a module, for it is
    sent to other processes by name. Raises ValueError if the folder holds trials of another seed, or a
    sealed answer was changed.
    """
    check_study(out, seed)
    generate(out, trials=trials, seed=seed, workers=workers)
    committed = commit(out, trials)
    diagnose(out, trials=trials, workers=workers, diagnosis=diagnosis)
    found = [
        _opened_and_scored(out, number, digest)
        for number, digest in progress(committed.items(), what="blind: scores", total=trials)
    ]
    section = blind_section(found)
    if images:
        for name, draw in PICTURES.items():
            draw(found).savefig(images / f"{name}.png", dpi=100)
    write_results(
        out, RESULTS, title=section.title, sections=[section], content=blind_json(found, seed=seed)
    )
    return section


def _opened_and_scored(out: Path, number: int, committed: str) -> Scored:
    folder = trial_folder(out, number)
    answer = answer_of(folder)
    label, truth = opened(folder, committed)
    rival = rival_distance(label, answer, truth)
    return scored(label, answer, true_shrink(answer, truth), rival)
