"""A policy with a memory: the unit is torch's, its teacher sees the plant, a seed means one policy."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
import torch
from safetensors.numpy import load_file, save_file

from controllers.base import Privileged
from controllers.hysteresis import Hysteresis
from controllers.learned import LearnedPolicy, load_policy
from controllers.policy_contract import WEIGHTS_FILE, PolicyError
from controllers.privileged_pulse import PrivilegedPulse
from controllers.pulse_simulation import pulse_table, pulse_tables
from controllers.tuned import build, load_tunings
from epv_env.observation import LAYOUT
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant
from epv_env.reward import RewardWeights
from tests.training.policies import random_layers
from training.evaluation.rollout import begin_episodes, make_env, run_episodes
from training.learners.distillation import Distillation, distil
from training.learners.hyperparameters import Hyperparameters
from training.learners.lessons import known_plants
from training.learners.policy_files import greedy_policy, put_layers, save_policy
from training.learners.ppo import make_model
from training.learners.recurrent_training import train_recurrent
from training.learners.student import NAME, Student, policy_of, put_policy, with_memory_of
from training.learners.training_env import make_training_env

pytestmark = pytest.mark.training

PLANT = Plant.calibrated()
OPTIONS = {
    "plant": PLANT, "scenario": "mixed", "parameters": "sensitive_ten_percent",
    "weights": RewardWeights(),
}  # fmt: skip
TINY = Distillation(
    memory=8, width=16, rounds=3, plants=4, episodes=16, periods=60, handover=2, kept=2, steps=4,
    window=30, batch=16, validations=2, validation_episodes=8, validation_duration=0.8,
)  # fmt: skip
TINY_PPO = Hyperparameters(
    num_envs=8, width=16, n_steps=16, batch_size=64, episode_steps=30, imitation_epochs=1, validations=2,
    validation_episodes=4, validation_duration=0.8,
)  # fmt: skip


@pytest.fixture(scope="module")
def student():
    torch.manual_seed(3)
    return Student(memory=TINY.memory, width=TINY.width)


@pytest.fixture(scope="module")
def readings():
    """Observations of episodes side by side: (periods, n, entries)."""
    rng = np.random.default_rng(1)
    return rng.normal(size=(40, 6, len(LAYOUT))).astype("f4")


def weights(policy):
    return [*(array for layer in policy.layers for array in layer), *vars(policy.cell).values()]


def same(one, other) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(weights(one), weights(other), strict=True))


def nothing(n) -> torch.Tensor:
    """The recurrent state of n episodes that begin."""
    return torch.zeros(n, TINY.memory)


SIMPLE = Hysteresis(
    open_below=0.0, shut_above=0.0, open_lookahead=0.01, shut_lookahead=0.01, name="simple"
)
"""It energises where p2, extrapolated over 10 ms, is above the target."""


def test_the_policy_computes_what_torch_does(student, readings):
    with torch.no_grad():
        expected = student(torch.as_tensor(readings.swapaxes(0, 1).copy()), nothing(6)).numpy().T
    policy = policy_of(student)
    policy.reset(readings.shape[1])
    logits = np.array([policy.logits(part) for part in readings])
    np.testing.assert_allclose(logits[..., 1] - logits[..., 0], expected, atol=1e-5)


def test_a_valve_is_decided_alone_as_in_a_batch_to_the_bit(student, readings):
    together, alone = policy_of(student), policy_of(student)
    together.reset(readings.shape[1])
    alone.reset(1)
    for part in readings:
        assert np.array_equal(together.logits(part)[2:3], alone.logits(part[2:3]))


def test_what_came_before_matters_until_it_is_forgotten(student, readings):
    policy = policy_of(student)
    policy.reset(6)
    first = policy.logits(readings[0])
    assert not np.array_equal(policy.logits(readings[0]), first)
    policy.reset(6)
    assert np.array_equal(policy.logits(readings[0]), first)


def test_a_written_policy_remembers_as_the_one_it_came_from(student, readings, tmp_path):
    policy = policy_of(student)
    save_policy(policy, tmp_path, control_period=5e-3, provenance={})
    loaded = load_policy(tmp_path)
    assert loaded.name == NAME
    assert same(loaded, policy)
    for each in (loaded, policy):
        each.reset(6)
    for part in readings:
        assert np.array_equal(loaded.logits(part), policy.logits(part))


def test_a_policy_whose_memory_is_missing_is_refused(student, tmp_path):
    policy = policy_of(student)
    save_policy(policy, tmp_path, control_period=5e-3, provenance={})
    without = {k: v for k, v in load_file(tmp_path / WEIGHTS_FILE).items() if "memory" not in k}
    save_file(without, tmp_path / WEIGHTS_FILE)
    with pytest.raises(PolicyError, match=r"lacks the array 'memory\.weight_input'"):
        load_policy(tmp_path)


def test_an_observation_ends_with_what_the_policy_remembers_in_its_own_episode(student):
    """Also the last one of an episode, which comes with the first one of the next."""
    policy = policy_of(student)
    h = replace(TINY_PPO, num_envs=3, episode_steps=5)
    env = make_training_env(h, seed=0, cell=policy.cell, **OPTIONS)
    entries = len(LAYOUT)
    policy.reset(3)
    first = shown = np.asarray(env.reset())
    ends: list[np.ndarray] = []
    while not ends:
        assert np.array_equal(policy.logits(shown[:, :entries]), layers_alone(policy, shown))
        shown, _, done, infos = env.step(np.ones(3, dtype=int))
        shown = np.asarray(shown)
        ends = [info["terminal_observation"] for info in np.array(infos)[done]]
    last = np.array(ends)
    assert np.array_equal(policy.logits(last[:, :entries]), layers_alone(policy, last))
    policy.reset(3)
    assert np.array_equal(policy.logits(shown[:, :entries]), layers_alone(policy, shown))
    assert not np.array_equal(last[:, entries:], first[:, entries:])


def layers_alone(policy, observations):
    """The logits of the layers, which see the memory in the observations."""
    return replace(policy, cell=None).logits(observations)


def test_ppo_goes_on_from_the_student(student, readings):
    """Its actor is the student's, and its policy has the student's unit; sharper, it doubts less."""
    policy = policy_of(student)
    env = make_training_env(TINY_PPO, seed=0, cell=policy.cell, **OPTIONS)
    model = make_model(TINY_PPO, env, seed=4, device="cpu")
    assert not same(greedy_policy(model, policy), policy)
    put_layers(model, policy, 1.0)
    assert same(greedy_policy(model, policy), policy)
    put_layers(model, policy, 3.0)
    sharp = greedy_policy(model, policy)
    for each in (sharp, policy):
        each.reset(6)
    for part in readings:
        np.testing.assert_allclose(sharp.logits(part), 3 * policy.logits(part), atol=1e-5)


def test_a_student_takes_a_policy_s_weights_and_gives_them_back(student, readings):
    policy, other = policy_of(student), Student(memory=TINY.memory, width=TINY.width)
    assert not same(policy_of(other), policy)
    put_policy(other, policy)
    assert same(policy_of(other), policy)
    put_policy(other, policy, sharpness=3.0)  # sharper, it doubts less
    sharp = policy_of(other)
    for each in (sharp, policy):
        each.reset(6)
    for part in readings:
        np.testing.assert_allclose(sharp.logits(part), 3 * policy.logits(part), atol=1e-5)


def test_each_valve_s_table_is_that_of_its_plant_to_the_bit():
    calibrated = Parameters.calibrated()
    plants = [calibrated.replace(cPV=f * calibrated["cPV"]) for f in (0.9, 1.0, 1.1)]
    p1, p2, p3, asked = (np.full(3, value) for value in (11.3, 7.9, 8.4, 0.15))
    together = pulse_tables(plants).duration(p1, p2, p3, asked)
    for k, plant in enumerate(plants):
        alone = pulse_table(plant).duration(p1[:1], p2[:1], p3[:1], asked[:1])
        assert together[k : k + 1] == alone
    assert len(set(together)) == 3  # else the plants would not matter


@pytest.mark.parametrize("informed", [False, True])
def test_only_a_pulse_that_knows_its_plant_holds_the_band_on_others(informed):
    tuned = build("pulse", load_tunings()["pulse"].values, PLANT)
    example = PrivilegedPulse() if informed else tuned
    assert isinstance(example, Privileged) == informed
    metrics, _ = run_episodes(example, seeds=list(range(40, 64)), duration=4.0, options=OPTIONS)
    assert np.all(metrics.stayed) == informed


def agreement(policy, example) -> float:
    """Share of the teacher's decisions that the policy shares, mean of offs and ons; unseen episodes."""
    env = make_env(policy, 16, **OPTIONS)
    observation = begin_episodes(env, example, list(range(900, 916)))
    policy.reset(16)
    wanted, given = [], []
    for _ in range(TINY.periods):
        wanted.append(example.act(observation))
        given.append(policy.act(observation))
        observation, *_ = env.step(wanted[-1])
    both = np.array(wanted), np.array(given)
    return float(np.mean([np.mean(both[1][both[0] == action] == action) for action in (0, 1)]))


def untrained_policy(d, seed):
    torch.manual_seed(seed)
    return policy_of(Student(memory=d.memory, width=d.width))


def test_a_student_comes_to_act_as_its_teacher():
    longer = replace(TINY, rounds=10, steps=16, learning_rate=1e-2)
    plants = known_plants(longer.plants, OPTIONS, seed=1, quiet=True)
    student = distil(longer, SIMPLE, plants, options=OPTIONS, seed=1, quiet=True)
    assert agreement(student, SIMPLE) > 0.9
    untrained = [agreement(untrained_policy(longer, seed), SIMPLE) for seed in range(6)]
    assert np.mean(untrained) < 0.7  # else there was nothing to learn


def test_a_seed_means_one_policy_and_an_interrupted_training_goes_on(tmp_path):
    def trained(folder, *, seed, resume=False, timesteps=256):
        policy, _ = train_recurrent(
            TINY_PPO, TINY, folder=folder, timesteps=timesteps, seed=seed, device="cpu", resume=resume,
            quiet=True, **OPTIONS,
        )  # fmt: skip
        return policy

    policy = trained(tmp_path / "one", seed=1)
    assert same(trained(tmp_path / "again", seed=1), policy)
    assert same(trained(tmp_path / "one", seed=1, resume=True), policy)  # nothing was left to do
    assert not same(trained(tmp_path / "other", seed=2), policy)


def test_a_policy_that_is_given_a_memory_acts_as_before(student):
    plain = LearnedPolicy(layers=random_layers(seed=5))
    remembering = with_memory_of(policy_of(student), plain)
    assert remembering.cells == TINY.memory
    plain.reset(4)
    remembering.reset(4)
    for seen in np.random.default_rng(1).normal(size=(20, 4, len(LAYOUT))):
        np.testing.assert_allclose(remembering.logits(seen), plain.logits(seen), rtol=1e-5)


def test_where_switching_is_cheap_ppo_goes_on_from_a_policy_without_a_memory(tmp_path):
    def trained(folder, price, student=None, memoryless=None):
        options: dict[str, Any] = OPTIONS | {"weights": RewardWeights(switching=price)}
        policy, _ = train_recurrent(
            TINY_PPO, TINY, folder=folder, student=student, memoryless=memoryless, timesteps=256, seed=1,
            device="cpu", resume=True, quiet=True, **options,
        )  # fmt: skip
        return policy

    cheap, usual = trained(tmp_path / "cheap", 0.0), trained(tmp_path / "usual", 0.3)
    assert not same(cheap, usual)
    assert not (tmp_path / "usual" / "memoryless").exists()
    kept = {name: tmp_path / "cheap" / name for name in ("student", "memoryless")}
    assert load_policy(kept["memoryless"]).cell is None
    assert same(trained(tmp_path / "given", 0.0, **kept), cheap)
    assert {path.name for path in (tmp_path / "given").iterdir() if path.is_dir()} == {"tensorboard"}
