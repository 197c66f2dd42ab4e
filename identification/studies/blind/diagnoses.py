"""The diagnoses of a blind check: each trial's campaign in a process that knows nothing else."""

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from identification.studies.blind.processes import run_in_processes
from identification.studies.blind.trials import REQUEST_FILE, trial_folder

DIAGNOSIS_FILE = "gap.json"


class DiagnosisFunction(Protocol):
    """What a trial asks of a diagnosis: read the campaign, write `out`/gap.json."""

    def __call__(
        self,
        campaign: Path,
        out: Path,
        *,
        without: Sequence[str] = (),
        report: bool = False,
        noise: Mapping[str, float] | None = None,
    ) -> object:
        """Diagnose a campaign with a catalogue that lacks the causes `without`.

        noise: standard deviation of the readings by channel [SI], where it is told.
        """
        ...


def named_folder(kind: str, disturbance: str = "") -> str:
    """Name of a trial's folder of a kind ('campaign', 'diagnosis'), for a disturbance or without."""
    return f"{kind}-{disturbance}" if disturbance else kind


def diagnose(
    out: Path,
    *,
    trials: int,
    workers: int,
    diagnosis: DiagnosisFunction,
    disturbance: str = "",
    disturbed_campaign: bool = False,
    noise: Mapping[str, float] | None = None,
) -> None:
    """Diagnose every trial that has no diagnosis yet, in processes that get the campaign only.

    Args:
        out: folder of the study.
        trials: number of trials.
        workers: processes.
        diagnosis: a function of a module, as other processes import it by name.
        disturbance: whose diagnoses they are; "": the study's own.
        disturbed_campaign: whether the disturbance has campaigns of its own.
        noise: standard deviation of the readings by channel [SI] that the diagnosis is told.
    """
    campaign = named_folder("campaign", disturbance if disturbed_campaign else "")
    answer = named_folder("diagnosis", disturbance)
    folders = [trial_folder(out, number) for number in range(trials)]
    jobs = [
        (diagnosis, folder / campaign, folder / answer, _excluded_causes(folder), noise)
        for folder in folders
        if not (folder / answer / DIAGNOSIS_FILE).exists()
    ]
    for failure in run_in_processes(diagnose_trial, jobs, workers=workers, label="blind: diagnoses"):
        if failure:
            print(failure, file=sys.stderr, flush=True)


def diagnose_trial(
    diagnosis: DiagnosisFunction,
    campaign: Path,
    out: Path,
    without: Sequence[str],
    noise: Mapping[str, float] | None,
) -> str | None:
    """Run one diagnosis. Returns a message if the diagnosis fails: the trial then has none."""
    try:
        diagnosis(campaign, out, without=without, report=False, noise=noise)
    except Exception as error:  # one failure must not end the study; it is shown and scored
        return f"{campaign}: the diagnosis failed: {type(error).__name__}: {error}"
    return None


def read_diagnosis(folder: Path, disturbance: str = "") -> dict[str, Any] | None:
    """Content of a trial's gap.json; None without one."""
    path = folder / named_folder("diagnosis", disturbance) / DIAGNOSIS_FILE
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def _excluded_causes(folder: Path) -> tuple[str, ...]:
    return tuple(json.loads((folder / REQUEST_FILE).read_text(encoding="utf-8"))["without"])
