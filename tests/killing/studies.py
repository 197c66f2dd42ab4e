"""The commands that are killed: how they start and go on, and which files must come out the same."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from epv_env.plant.parameters import Parameters
from identification.bench.programmes import DIAGNOSIS_SUITE
from identification.bench.session import run_bench
from identification.recordings.campaign_files import write_campaign

ROOT = Path(__file__).parents[2]

RECORDINGS = ("test1", "low_supply", "validation")
"""Of the campaign that `gap` diagnoses."""


@dataclass(frozen=True, kw_only=True)
class Study:
    """A command that is long when it is not shortened."""

    name: str
    arguments: tuple[str, ...]
    """The command without its --out."""
    results: tuple[str, ...]
    """Files of results; they name neither the run nor its date."""
    go_on: tuple[str, ...] = ()
    """Options with which a killed run is continued; without it, the same command continues."""
    begin_anew: tuple[str, ...] = ()
    """Options that replace what a run left that was killed before it had anything to continue."""
    prepare: Callable[[Path], object] = lambda _: None
    """Writes what the command reads into the folder in which it runs."""


def _write_campaign(folder: Path) -> None:
    programmes = [programme for programme in DIAGNOSIS_SUITE if programme.name in RECORDINGS]
    truth = Parameters.calibrated().replace(G_eddy=4e-3)
    write_campaign(run_bench(programmes, truth, seed=3), folder / "campaign")


STUDIES = (
    Study(
        name="sweep",
        arguments=(
            str(ROOT / "training/sweep.py"), "--quick", "--workers", "2",
            "--controllers", "hysteresis, extrapolating",
            "--designs", "conditions", "hypercube", "worst", "--factors", "sensor noise",
        ),
        results=("results.json", "points.csv", "hypercube.csv"),
    ),
    Study(
        name="compare",
        arguments=(
            str(ROOT / "training/compare.py"), "--quick", "--workers", "2",
            "--named", "4", "--random", "8", "--bound", "8",
        ),
        results=("results.json", "tables.md"),
    ),
    Study(
        name="gap",
        arguments=("-m", "identification", "gap", "campaign"),
        results=("plant.json", "gap.json"),
        prepare=_write_campaign,
    ),
    Study(
        name="train",
        arguments=(str(ROOT / "training/train_ppo.py"), "--quick", "--episodes", "4"),
        results=("policy.safetensors", "table.csv"),
        go_on=("--resume",),
        begin_anew=("--force",),
    ),
)  # fmt: skip
