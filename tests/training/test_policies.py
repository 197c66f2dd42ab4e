"""Training side by side: what is missing, and the same as one after the other."""

from dataclasses import replace

import pytest

pytest.importorskip("joblib")
pytest.importorskip("stable_baselines3")

from training.learners.policy_folders import seed_policies, seed_trainings, train_missing
from training.train_ppo import QUICK_HYPERPARAMETERS

pytestmark = pytest.mark.training


def short_trainings(folder):
    """Of two seeds, short in imitation and validation, too."""
    usual = seed_trainings(folder, count=2, timesteps=16_384)
    return [replace(each, unusual=QUICK_HYPERPARAMETERS) for each in usual]


def test_policies_do_not_depend_on_how_many_are_trained_at_a_time(tmp_path):
    together, others = (short_trainings(tmp_path / name) for name in ("two", "one"))
    alone = others[1]
    train_missing(together, workers=2)
    train_missing([alone], workers=2)
    assert set(seed_policies(together)) == {"seed 0", "seed 1"}
    first, second, same = (
        (each.folder / "policy.safetensors").read_bytes() for each in (*together, alone)
    )
    assert first != second
    assert second == same


def test_what_is_there_is_kept(tmp_path):
    trainings = seed_trainings(tmp_path, count=2, timesteps=16_384)
    for each in trainings:
        each.folder.mkdir()
        (each.folder / "policy.json").write_text("{}")
    train_missing(trainings, workers=2)
    assert [path.name for path in sorted(tmp_path.rglob("*.*"))] == ["policy.json", "policy.json"]
