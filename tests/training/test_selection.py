"""The best policy of a training is kept, judged on scenarios of its own; a seed means one policy."""

import csv
from dataclasses import fields, replace

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from controllers.learned import LearnedPolicy
from epv_env.plant.plantfile import Plant
from epv_env.reward import RewardWeights
from training.evaluation.metrics import EpisodeMetrics
from training.evaluation.rollout import run_episodes
from training.evaluation.seeds import VALIDATION_SEED
from training.learners import learning_log
from training.learners.batch_ppo import BatchPPO
from training.learners.checkpoint_selection import validation_points
from training.learners.hyperparameters import Hyperparameters
from training.learners.learning_log import VALIDATION_FILE
from training.learners.ppo import train
from training.learners.validation import score

pytestmark = pytest.mark.training

TINY = Hyperparameters(
    imitation_epochs=1,
    num_envs=8, n_steps=16, batch_size=64, episode_steps=40, learning_rate=0.01,
    validations=4, first_validation=0.25, validation_episodes=6, validation_duration=0.8,
)  # fmt: skip
TASK = {
    "plant": Plant.calibrated(), "scenario": "mixed", "parameters": "ten_percent",
    "weights": RewardWeights(band=TINY.band_price),
}  # fmt: skip
TIMESTEPS = 1024


def trained(folder, *, timesteps=TIMESTEPS, seed=1, resume=False):
    policy, _ = train(
        TINY, folder=folder, **TASK, timesteps=timesteps, seed=seed, device="cpu",
        resume=resume, quiet=True,
    )  # fmt: skip
    return policy


def read_rows(path):
    """The numbers of a table by column."""
    with path.open(newline="") as stream:
        return [
            {name: float(value) for name, value in row.items() if name != "run"}
            for row in csv.DictReader(stream)
        ]


def same(one: LearnedPolicy, other: LearnedPolicy) -> bool:
    return all(
        np.array_equal(a, b)
        for layers in zip(one.layers, other.layers, strict=True)
        for a, b in zip(*layers, strict=True)
    )


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("training")
    return folder, trained(folder)


def test_what_training_returns_is_the_best_that_was_validated(finished):
    folder, policy = finished
    rows = read_rows(folder / VALIDATION_FILE)
    assert [row["timesteps"] for row in rows] == [256, 512, 768, 1024]
    seeds = list(range(VALIDATION_SEED, VALIDATION_SEED + TINY.validation_episodes))
    metrics, _ = run_episodes(policy, seeds=seeds, duration=TINY.validation_duration, options=TASK)
    scores = [row["score"] for row in rows]
    assert len(set(scores)) > 1  # else the check below says nothing
    assert score(metrics) == pytest.approx(max(scores), rel=1e-12)


def test_a_seed_means_one_policy(finished, tmp_path, monkeypatch):
    """And a training leaves nothing but its folder."""
    folder, policy = finished
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    assert same(trained(tmp_path / "again"), policy)
    assert not list((tmp_path / "temporary").iterdir())
    again = read_rows(tmp_path / "again" / VALIDATION_FILE)
    assert again == read_rows(folder / VALIDATION_FILE)
    assert not same(trained(tmp_path / "other", seed=2), policy)


def test_a_resumed_training_keeps_what_was_validated_before(tmp_path):
    trained(tmp_path, timesteps=512)
    before = read_rows(tmp_path / VALIDATION_FILE)
    trained(tmp_path, resume=True)
    after = read_rows(tmp_path / VALIDATION_FILE)
    assert after[: len(before)] == before
    assert after[-1]["timesteps"] == TIMESTEPS
    finished = trained(tmp_path, resume=True)
    assert read_rows(tmp_path / VALIDATION_FILE) == after
    assert same(finished, trained(tmp_path, resume=True))


@pytest.mark.parametrize("rollouts", [1, 3, 6])
def test_a_killed_training_resumes_to_the_same_policy(finished, tmp_path, monkeypatch, rollouts):
    """To the bit: the run dies after some rollouts, without a word, and its last checkpoint is old."""
    _, policy = finished
    collected = BatchPPO.collect_rollouts
    remaining = iter(range(rollouts))

    def dying(*arguments, **named):
        if next(remaining, None) is None:
            raise SystemError("killed")
        return collected(*arguments, **named)

    monkeypatch.setattr(BatchPPO, "collect_rollouts", dying)
    monkeypatch.setattr(learning_log, "CHECKPOINT_SECONDS", 0.0 if rollouts == 3 else 3600.0)
    with pytest.raises(SystemError):
        trained(tmp_path)
    monkeypatch.undo()
    assert same(trained(tmp_path, resume=True), policy)


def test_validation_points_end_with_the_training():
    assert validation_points(1000, first_share=0.6, count=5) == [600, 700, 800, 900, 1000]
    assert validation_points(1000, first_share=0.6, count=1) == [1000]


def test_an_episode_that_leaves_the_band_weighs_more_than_a_few_points_of_return():
    n = 100
    zeros = EpisodeMetrics(**{f.name: np.zeros(n) for f in fields(EpisodeMetrics)})
    inside = replace(zeros, stayed=np.ones(n, dtype=bool), episode_return=np.full(n, -102.0))
    once_left = replace(zeros, stayed=np.arange(n) > 0, episode_return=np.full(n, -100.0))
    assert score(inside) > score(once_left)
    assert score(inside) == -102.0
