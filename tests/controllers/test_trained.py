"""The policies that come with the project are what their folders say, and hold the band."""

import json
from pathlib import Path

import pytest

pytest.importorskip("safetensors")

from controllers.learned import TRAINED, load_policy
from controllers.policy_contract import CONTRACT_FILE, WEIGHTS_FILE
from controllers.supervised import SUPERVISOR_FILE, load_settings
from training.evaluation.rollout import run_episodes

ROOT = Path(__file__).parents[2]
POLICIES = ROOT / "docs" / "results" / "policies"
"""Every policy of the comparison; the package holds one of each kind, to which links lead from here."""
IN_PACKAGE = ("plain/seed-0", "recurrent/seed-7", "end-to-end/seed-0")
WITH_MEMORY = ("recurrent", "end-to-end")

FOLDERS = sorted(path.parent for path in POLICIES.rglob(CONTRACT_FILE))
SEEDS = [folder for folder in FOLDERS if folder.name.startswith("seed-")]


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: str(folder.relative_to(POLICIES)))
def test_each_can_be_loaded_and_remembers_if_it_should(folder: Path):
    policy = load_policy(folder)
    assert (policy.cells > 0) == (not {"recurrent", "end-to-end"}.isdisjoint(folder.parts))


@pytest.mark.parametrize("folder", SEEDS, ids=lambda folder: str(folder.relative_to(POLICIES)))
def test_each_was_trained_with_the_seed_that_it_is_named_after(folder: Path):
    provenance = json.loads((folder / CONTRACT_FILE).read_text())["provenance"]
    assert folder.name == f"seed-{provenance['seed']}"


def test_the_comparison_finds_ten_seeds_of_each_kind_and_two_variants_at_each_price():
    names = {str(folder.relative_to(POLICIES)) for folder in FOLDERS}
    seeds = {f"{kind}/seed-{seed}" for kind in ("plain", *WITH_MEMORY) for seed in range(10)}
    prices = {
        f"tradeoff/price-{price}{kind}"
        for price in ("0", "0.5", "1", "2")
        for kind in ("", "/recurrent")
    }
    students = {f"{kind}/seed-{seed}/student" for kind in WITH_MEMORY for seed in range(10)}
    assert names == seeds | prices | students


def test_the_packages_hold_one_policy_of_each_kind_and_nothing_else():
    """All files of the packages go into the wheel."""
    packages = [ROOT / name for name in ("epv_env", "identification", "controllers", "training")]
    weights = {path.parent for package in packages for path in package.rglob("*.safetensors")}
    assert weights == {TRAINED / name for name in IN_PACKAGE}
    files = {str(path.relative_to(TRAINED)) for path in TRAINED.rglob("*") if path.is_file()}
    expected = {f"{name}/{file}" for name in IN_PACKAGE for file in (CONTRACT_FILE, WEIGHTS_FILE)}
    assert files == expected | {f"{name}/{SUPERVISOR_FILE}" for name in IN_PACKAGE[1:]}


@pytest.mark.parametrize("name", IN_PACKAGE)
def test_a_policy_of_the_package_is_the_one_that_is_compared(name: str):
    for file in (TRAINED / name).iterdir():
        assert (POLICIES / name / file.name).resolve() == file.resolve()


@pytest.mark.parametrize("kind", WITH_MEMORY)
def test_each_seed_with_a_memory_has_a_supervisor(kind: str):
    for seed in range(10):
        assert load_settings(POLICIES / kind / f"seed-{seed}") is not None


@pytest.mark.parametrize("name", IN_PACKAGE[1:])
def test_one_with_a_memory_holds_the_band_on_valves_that_it_does_not_know(name: str):
    policy = load_policy(TRAINED / name)
    options = {"parameters": "sensitive_ten_percent"}
    metrics, _ = run_episodes(policy, seeds=list(range(64)), duration=5.0, options=options)
    assert metrics.stayed.mean() > 0.95
    assert metrics.rms_bar.mean() < 0.15
