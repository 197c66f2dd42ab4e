"""The policies that come with the project are what their folders say, and hold the band."""

import json
from pathlib import Path

import pytest

pytest.importorskip("safetensors")

from controllers.learned import CONTRACT_FILE, TRAINED, load_policy
from training.evaluation.rollout import run_episodes

FOLDERS = sorted(path.parent for path in TRAINED.rglob(CONTRACT_FILE))
SEEDS = [folder for folder in FOLDERS if folder.name.startswith("seed-")]


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: str(folder.relative_to(TRAINED)))
def test_each_can_be_loaded_and_remembers_if_it_should(folder: Path):
    policy = load_policy(folder)
    assert (policy.cells > 0) == ("recurrent" in folder.parts)


@pytest.mark.parametrize("folder", SEEDS, ids=lambda folder: str(folder.relative_to(TRAINED)))
def test_each_was_trained_with_the_seed_that_it_is_named_after(folder: Path):
    provenance = json.loads((folder / CONTRACT_FILE).read_text())["provenance"]
    assert folder.name == f"seed-{provenance['seed']}"


def test_one_with_a_memory_holds_the_band_on_valves_that_it_does_not_know():
    policy = load_policy(TRAINED / "recurrent" / "seed-7")
    options = {"parameters": "sensitive_ten_percent"}
    metrics, _ = run_episodes(policy, seeds=list(range(64)), duration=5.0, options=options)
    assert metrics.stayed.mean() > 0.95
    assert metrics.rms_bar.mean() < 0.15
