"""Training: the net is what stable-baselines3 trains, the best is kept, a stopped run goes on."""

import base64
import json
import os
import zipfile
from pathlib import Path
from typing import Any, cast

import cloudpickle
import numpy as np
import pandas as pd
import pytest

pytest.importorskip("stable_baselines3")
import torch

from controllers.knowledge import INPUTS
from controllers.policy import load_policy
from controllers.policy_files import read_policy, write_policy
from epv_env.observation import ENTRIES
from epv_env.plant.plantfile import Plant
from epv_env.reward import RewardWeights
from training.commands.train import Options, next_step, sentence_of, verdict
from training.evaluation.scenarios import REFILL_TIME
from training.learners import ppo, selection
from training.learners.actor import network_of
from training.learners.environment import REWARD_SCALE, make_training_env, training_weights
from training.learners.ppo import Task, checkpoints, make_model, read_rows, train
from training.learners.selection import train_seeds

pytestmark = pytest.mark.training
TASK = Task(plant=Plant.calibrated())
SHORT = {"num_envs": 8, "validation_episodes": 8, "validation_duration": 1.0}


@pytest.fixture(scope="module")
def env():
    return make_training_env(
        plant=Plant.calibrated(), num_envs=4, weights=RewardWeights(), parameters="exact"
    )


def test_the_written_network_is_the_actor_that_is_trained_and_begins_with_the_advice(env):
    model = make_model(env, seed=3)
    inputs = np.random.default_rng(0).normal(size=(200, INPUTS)).astype("f4")
    with torch.no_grad():
        distribution: Any = model.policy.get_distribution(torch.from_numpy(inputs)).distribution
    expected = distribution.logits.numpy()
    logits = network_of(model).logits(inputs)
    difference = np.diff(logits, axis=1) - np.diff(expected, axis=1)  # torch normalises its logits
    assert np.max(np.abs(difference)) < 1e-5
    inputs[:, -1] = np.sign(inputs[:, -1])
    begins = np.argmax(network_of(model).logits(inputs), axis=1)
    assert np.array_equal(begins, (inputs[:, -1] > 0).astype(int))


def test_training_is_stricter_than_the_reward_and_follows_its_prices():
    usual, dear = (training_weights(RewardWeights(switching=price)) for price in (0.3, 3.0))
    assert dear.switching == pytest.approx(10 * usual.switching)
    assert usual.switching > 0.3
    assert usual.band_bar < RewardWeights().band_bar


def test_rewards_are_scaled_and_the_monitor_counts_them_as_they_are(env):
    env.reset()
    total, ended, infos = np.zeros(4), [], []
    for _ in range(400):
        _, rewards, dones, infos = env.step(np.ones(4, int))
        total += rewards
        ended = [i for i in np.flatnonzero(dones) if "episode" in infos[i]]
        if ended:
            break
    i = ended[0]
    assert infos[i]["episode"]["r"] * REWARD_SCALE == pytest.approx(total[i], rel=1e-3)
    assert infos[i]["terminal_observation"].shape == env.observation_space.shape


def stop(course: ppo.Course) -> bool:
    """Ends a training as a kill would: nothing more is written."""
    if course.num_timesteps >= 1500:
        raise KeyboardInterrupt
    return True


class Trap:
    """A pickle of it makes a folder where it is loaded."""

    def __init__(self, path: Path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


def leave_trap(archive: Path, executed: Path) -> None:
    """A checkpoint as stable-baselines3 writes one, of the most steps, that runs code when loaded."""
    trap = base64.b64encode(cloudpickle.dumps(Trap(executed))).decode()
    content = {"policy_class": {":type:": "x", ":serialized:": trap}}
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("data", json.dumps(content))


def test_a_stopped_training_ends_with_the_same_policy(tmp_path: Path, monkeypatch):
    monkeypatch.setattr(ppo, "CHECKPOINT_STEPS", 512)
    whole, stopped = tmp_path / "whole", tmp_path / "stopped"
    rows = train(TASK, whole, timesteps=2048, **SHORT)
    with monkeypatch.context() as patch:
        patch.setattr(ppo.Course, "_on_step", stop)
        with pytest.raises(KeyboardInterrupt):
            train(TASK, stopped, timesteps=2048, **SHORT)
    newest, *_ = checkpoints(stopped)
    newest.write_bytes(newest.read_bytes()[:-1])  # torn: the one before is taken up
    leave_trap(stopped / "checkpoints" / "ppo_99999_steps.zip", tmp_path / "executed")
    assert not (stopped / "policy.json").exists()
    assert train(TASK, stopped, timesteps=2048, resume=True, **SHORT) == rows
    assert [row["timesteps"] for row in read_rows(stopped)] == sorted({r["timesteps"] for r in rows})
    assert not (tmp_path / "executed").exists()
    name = "policy.safetensors"
    assert (stopped / name).read_bytes() == (whole / name).read_bytes()
    best = max(rows, key=lambda row: row["score"])
    assert read_policy(whole)[0].provenance["timesteps"] == best["timesteps"]
    policy = load_policy(whole)
    policy.reset(2)
    assert set(policy.act(np.zeros((2, ENTRIES)))) <= {0, 1}


def test_seeds_are_ranked_by_violations_then_return_and_none_is_trained_twice(tmp_path, monkeypatch):
    found = {1: (3, -90.0), 2: (2, -80.0), 3: (2, -70.0)}
    monkeypatch.setattr(selection, "validated", lambda policy, *_: policy)
    monkeypatch.setattr(selection, "load_policy", lambda folder, _: int(folder.name[-1]))
    monkeypatch.setattr(
        selection, "figures",
        lambda seed: dict(zip(("violation_rate", "return"), found[seed], strict=True)),
    )  # fmt: skip
    trained = []

    def as_trained(task, folder, *, seed, resume):
        trained.append(seed)
        write_policy(load_policy().network, folder, control_period=5e-3, provenance={"seed": seed})

    monkeypatch.setattr(selection, "train", as_trained)
    for seeds in ([1, 2], [1, 2, 3]):  # the first time it is stopped after two
        table = train_seeds(TASK, tmp_path, seeds=seeds)
    assert trained == [1, 2, 3]
    assert list(table["seed"]) == [3, 2, 1]
    assert list(pd.read_csv(tmp_path / selection.TABLE)["seed"]) == [3, 2, 1]


def test_seeds_are_validated_on_empty_control_chambers_with_the_time_of_their_refill(monkeypatch):
    monkeypatch.setattr(selection, "run_batches", lambda batches, *_, **__: batches)
    batch = cast(Any, selection.validated(load_policy(), TASK, 8, 10.0))
    assert batch.options["conditions"].vented > 0
    assert batch.options["conditions"].braking == 0
    assert batch.options["settling_time"] == REFILL_TIME


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [(1.0, 3.0, "is better than"), (-3.0, -1.0, "is worse than"), (-1.0, 1.0, "cannot be told from")],
)
def test_the_verdict_says_what_the_interval_allows(low, high, words):
    scores = ["return", "violation rate [%]", "switchings [1/s]"]
    paired = pd.DataFrame(
        {"controller": "PPO", "score": scores, "difference": 0.5, "low": low, "high": high}
    )
    sentence = sentence_of(paired, Options(episodes=100, parameters="ten_percent"))
    assert f"{words} the 'adaptive pulse' controller on 100 unseen episodes" in sentence
    assert "(plants: 4 parameters ±10 %)" in sentence


@pytest.mark.parametrize(
    ("parameters", "words"),
    [("exact", "the plant itself"), ("confidence", "its confidence region"),
     ("domain", "4 parameters in their domains")],
)  # fmt: skip
def test_the_verdict_is_given_on_the_plants_that_were_trained_on(
    parameters, words, tmp_path, monkeypatch
):
    monkeypatch.setattr("training.commands.train.load_policy", lambda folder, plant: load_policy())
    options = Options(out=tmp_path, parameters=parameters, episodes=2, duration=0.55, quick=True)
    assert f"plants: {words};" in verdict(options, Plant.calibrated(), RewardWeights())


@pytest.mark.parametrize(
    ("given", "command"),
    [({"parameters": "confidence"}, "--parameters confidence"),
     ({"seed": 3, "scenario": "steps"}, "--seed 3 --scenario steps"),
     ({"switching_price": 0.5}, "--switching-price 0.5")],
)  # fmt: skip
def test_the_training_after_a_short_one_has_the_same_options(given, command):
    words = next_step(Options(quick=True, **given)).command()
    assert words == f"epv train {command} --out runs/ppo-full"


@pytest.mark.parametrize(
    ("parameters", "more"),
    [("confidence", ""), ("exact", ""),
     ("diagnosis", " --plants calibrated confidence sensitive_ten_percent diagnosis")],
)  # fmt: skip
def test_the_comparison_after_a_training_has_its_plants(parameters, more):
    words = next_step(Options(parameters=parameters, plant=Path("plant.json"))).command()
    assert words.partition("runs/ppo-comparison")[2] == f"{more} --plant plant.json"
