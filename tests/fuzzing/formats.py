"""Every file format that we read: a good file, and the function that reads it."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from controllers.learned import TRAINED, load_policy
from controllers.policy_contract import CONTRACT_FILE, WEIGHTS_FILE
from controllers.supervised import SUPERVISOR_FILE, SupervisorFile, load_settings, save_settings
from controllers.supervisor_settings import SETTINGS
from controllers.tuned import TUNED_FILE, load_tunings
from epv_env.common.files import Journal, write_bytes
from epv_env.common.results_folder import CONFIG, check_options, write_options
from epv_env.plant.plantfile import Plant, load_plant, save_plant
from identification.bench.programmes import REPORT_SUITE, load_programmes, save_programmes
from identification.importing.mapping_file import read_mapping
from identification.recordings.campaign_files import FILE_NAME, read_campaign, write_campaign
from identification.recordings.columns import REQUIRED_COLUMNS, read_columns
from tests.identification.recordings.good_campaign import campaign_of, switching
from training.studies.benchmark.result_file import (
    Entry,
    Results,
    Run,
    read_results,
    write_results,
)

SUBJECT = {"seed": 0}


@dataclass(frozen=True, kw_only=True)
class Format:
    """One format."""

    name: str
    file: str
    """Name of the file within a folder."""
    write: Callable[[Path], None]
    """Fills the folder with a good file, and what else its reader needs."""
    read: Callable[[Path], Any]
    """Reads the folder's file. Raises ValueError or OSError."""
    json: bool = True
    """Whether the file is one JSON value."""


def outcome(form: Format, folder: Path) -> str:
    """What becomes of a folder's file: still good, refused, or refused in more than a sentence."""
    try:
        form.read(folder)
    except (ValueError, OSError) as refusal:
        one = str(refusal) and "\n" not in str(refusal)
        return "refused" if one else f"more than a sentence: {refusal}"
    return "still good"


def _copied(folder: Path) -> None:
    source = TRAINED / "plain" / "seed-0"
    for name in (CONTRACT_FILE, WEIGHTS_FILE):
        (folder / name).write_bytes((source / name).read_bytes())


def _manifest(folder: Path) -> None:
    write_campaign(campaign_of(switching()), folder)


def _mapping(folder: Path) -> None:
    content = {
        "format": "epv-mapping/1", "environment": {"temperature_K": 293.0, "pressure_bar": 1.0},
        "channels": {"p2": {"source": "P2_raw", "unit": "mbar gauge", "factor": 1.0}},
        "recordings": {"a.mf4": {"role": "calibration", "name": "test1"}},
    }  # fmt: skip
    (folder / "mapping.json").write_text(json.dumps(content))


def _table(folder: Path) -> None:
    names = [*REQUIRED_COLUMNS, "p1_bar"]
    rows = np.linspace(0.0, 1.0, 20 * len(names)).reshape(20, -1)
    lines = [",".join(names), *(",".join(f"{value:.6f}" for value in row) for row in rows)]
    (folder / "recording.csv").write_text("\n".join(lines) + "\n")


def _journal(folder: Path) -> None:
    journal = Journal(folder / "finished.jsonl", SUBJECT)
    for k in range(3):
        journal.add(f"task {k}", {"value": k})


def _results(folder: Path) -> None:
    run = Run(seed=0, mean_return=-1.0, left_share=0.0, rms_error_bar=0.1, switchings_per_s=5.0)
    entry = Entry(algorithm="a", environment="EPValve-v0", timesteps=100, runs=[run])
    write_results(folder / "benchmark.json", Results(entries=[entry]))


FORMATS = (
    Format(
        name="plant file", file="plant.json",
        write=lambda folder: save_plant(Plant.calibrated(), folder / "plant.json"),
        read=lambda folder: load_plant(folder / "plant.json"),
    ),
    Format(
        name="programme file", file="next.json",
        write=lambda folder: save_programmes(REPORT_SUITE, folder / "next.json"),
        read=lambda folder: load_programmes(folder / "next.json"),
    ),
    Format(name="manifest", file=FILE_NAME, write=_manifest, read=read_campaign),
    Format(
        name="mapping", file="mapping.json", write=_mapping,
        read=lambda folder: read_mapping(folder / "mapping.json"),
    ),
    Format(name="policy's contract", file=CONTRACT_FILE, write=_copied, read=load_policy),
    Format(name="policy's weights", file=WEIGHTS_FILE, write=_copied, read=load_policy, json=False),
    Format(
        name="supervisor's settings", file=SUPERVISOR_FILE,
        write=lambda folder: save_settings(SupervisorFile(settings=SETTINGS), folder),
        read=load_settings,
    ),
    Format(
        name="tuned controllers", file="tuned.json",
        write=lambda folder: write_bytes(folder / "tuned.json", TUNED_FILE.read_bytes()),
        read=lambda folder: load_tunings(folder / "tuned.json"),
    ),
    Format(
        name="configuration", file=CONFIG,
        write=lambda folder: write_options(folder, SUBJECT),
        read=lambda folder: check_options(folder, SUBJECT, "study"),
    ),
    Format(
        name="benchmark", file="benchmark.json", write=_results,
        read=lambda folder: read_results(folder / "benchmark.json"),
    ),
    Format(
        name="recording", file="recording.csv", write=_table, json=False,
        read=lambda folder: read_columns("recording.csv", (folder / "recording.csv").read_bytes()),
    ),
    Format(
        name="journal", file="finished.jsonl", write=_journal, json=False,
        read=lambda folder: Journal(folder / "finished.jsonl", SUBJECT),
    ),
)  # fmt: skip
"""Every format of our own; those of measurement systems are read by their makers' packages."""
