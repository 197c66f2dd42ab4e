"""A policy with a memory: the unit is torch's, its teacher sees the plant, a seed means one policy."""

from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
import torch
from safetensors.numpy import load_file, save_file

from controllers.base import Privileged
from controllers.learned import WEIGHTS_FILE, LearnedPolicy, PolicyError, load_policy
from controllers.pulse_table import PulseTables, pulse_table
from epv_env.observation import INDEX, LAYOUT
from epv_env.plant.parameters import Parameters, sensitive_symbols
from epv_env.plant.plantfile import Plant
from epv_env.reward import RewardWeights
from training.distil import (
    NAME,
    Distillation,
    Student,
    distil,
    policy_of,
    train_recurrent,
    trim,
    trimmed,
)
from training.ecu.quantise import ExportError
from training.export import check
from training.informed import FARTHEST, Informed, plant_code
from training.policy_files import save_policy
from training.ppo import Hyperparameters, make_training_env, teacher
from training.rollout import begin_episodes, make_env, run_episodes

pytestmark = pytest.mark.training

PLANT = Plant.calibrated()
OPTIONS = {
    "plant": PLANT, "scenario": "mixed", "parameters": "sensitive_ten_percent",
    "weights": RewardWeights(),
}  # fmt: skip
TINY = Distillation(
    memory=8, width=16, rounds=3, episodes=16, periods=60, handover=2, kept=2, epochs=1, batch=8,
    validations=2, validation_episodes=8, validation_duration=0.8, trims=(0.0, 0.05), trim_episodes=8,
    trim_duration=0.8,
)  # fmt: skip
TINY_PPO = Hyperparameters(
    num_envs=8, n_steps=16, batch_size=64, episode_steps=30, imitation_epochs=1, validations=2,
    validation_episodes=4, validation_duration=0.8,
)  # fmt: skip


@pytest.fixture(scope="module")
def student():
    torch.manual_seed(3)
    return Student(TINY)


@pytest.fixture(scope="module")
def readings():
    """Observations of episodes side by side: (periods, n, entries)."""
    rng = np.random.default_rng(1)
    return rng.normal(size=(40, 6, len(LAYOUT))).astype("f4")


def weights(policy):
    return [*(array for layer in policy.layers for array in layer), *vars(policy.cell).values()]


def same(one, other) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(weights(one), weights(other), strict=True))


def simple_teacher():
    """It energises where p2, extrapolated over 10 ms, is above the target."""
    row = np.zeros(len(LAYOUT) + len(sensitive_symbols()), dtype=np.float32)
    row[INDEX["p2_error"]], row[INDEX["p2_change_4"]] = 40.0, 4.0
    layer = np.stack([0 * row, row]), np.zeros(2, dtype=np.float32)
    return Informed(LearnedPolicy(layers=[layer]))


def test_the_policy_computes_what_torch_does(student, readings):
    with torch.no_grad():
        expected = student(torch.as_tensor(readings.swapaxes(0, 1).copy())).numpy().T
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


def test_a_policy_with_a_memory_is_not_exported(student, tmp_path):
    with pytest.raises(ExportError, match="has a memory"):
        check(policy_of(student), tmp_path)


def test_a_trimmed_policy_takes_p2_for_higher(student, readings):
    shifted = readings.copy()
    shifted[..., INDEX["p2_error"]] += 0.04 / LAYOUT[INDEX["p2_error"]].scale
    policy, high = policy_of(student), trimmed(policy_of(student), 0.04)
    for each in (policy, high):
        each.reset(6)
    for part, higher in zip(readings, shifted, strict=True):
        np.testing.assert_allclose(high.logits(part), policy.logits(higher), atol=1e-5)


def test_the_trim_is_the_one_with_which_fewest_leave():
    """Of equals, the one with the best return."""

    def run(policy, *, seeds, duration, options):
        left = {0.0: 3, 0.02: 1, 0.03: 1}[policy]
        returns = {0.0: -10.0, 0.02: -12.0, 0.03: -11.0}[policy]
        stayed = np.arange(len(seeds)) >= left
        return SimpleNamespace(stayed=stayed, episode_return=np.array([returns])), None

    d = replace(TINY, trims=(0.0, 0.02, 0.03))
    with (
        patch("training.distil.run_episodes", run),
        patch("training.distil.trimmed", lambda _, bar: bar),
    ):
        assert trim(d, None, options={}) == 0.03  # type: ignore[arg-type]


def test_the_code_is_the_distance_from_the_centre_in_tenths():
    symbols = sensitive_symbols()
    centre = PLANT.parameters
    options = {**OPTIONS, "parameters": {symbols[0]: 1.1 * centre[symbols[0]]}}
    env = make_env(teacher(PLANT), 2, **options)
    env.reset(seed=0)
    # The centre of an exact choice is the plant itself.
    np.testing.assert_array_equal(plant_code(env.task), 0)
    env = make_env(teacher(PLANT), 64, **OPTIONS)
    env.reset(seed=0)
    code = plant_code(env.task)
    assert code.shape == (64, len(symbols))
    assert 0.9 < np.abs(code).max() <= 1.0
    plant = env.task.parameters[5]
    assert plant is not None
    assert plant[symbols[3]] == pytest.approx(centre[symbols[3]] * (1 + code[5, 3] / 10))


def test_each_observation_shows_the_plant_of_its_own_episode():
    """Also the last one of an episode, which comes with the first one of the next."""
    h = replace(TINY_PPO, num_envs=3, episode_steps=5)
    env = make_training_env(h, seed=0, informed=True, **OPTIONS)
    entries = len(LAYOUT)
    first = np.asarray(env.reset())[:, entries:]
    assert np.all(np.abs(first) <= FARTHEST)
    for _ in range(h.episode_steps - 1):
        env.step(np.ones(3, dtype=int))
    observation, _, done, infos = env.step(np.ones(3, dtype=int))
    assert np.all(done)
    last = np.array([info["terminal_observation"][entries:] for info in infos])
    assert np.array_equal(last, first)
    assert not np.any(np.all(np.asarray(observation)[:, entries:] == first, axis=1))


def test_each_valve_s_table_is_that_of_its_plant_to_the_bit():
    calibrated = Parameters.calibrated()
    plants = [calibrated.replace(cPV=f * calibrated["cPV"]) for f in (0.9, 1.0, 1.1)]
    p1, p2, p3, asked = (np.full(3, value) for value in (11.3, 7.9, 8.4, 0.15))
    together = PulseTables.of(plants).duration(p1, p2, p3, asked)
    for k, plant in enumerate(plants):
        alone = pulse_table(plant).duration(p1[:1], p2[:1], p3[:1], asked[:1])
        assert together[k : k + 1] == alone
    assert len(set(together)) == 3  # else the plants would not matter


@pytest.mark.parametrize("informed", [True, False])
def test_only_a_pulse_that_knows_its_plant_holds_the_band_on_others(informed):
    example = teacher(PLANT, informed=informed)
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
    return policy_of(Student(d))


def test_a_student_comes_to_act_as_its_teacher():
    longer = replace(TINY, rounds=10, epochs=4, learning_rate=1e-2)
    example = simple_teacher()
    student = distil(longer, example, options=OPTIONS, seed=1, quiet=True)
    assert agreement(student, example) > 0.9
    untrained = [agreement(untrained_policy(longer, seed), example) for seed in range(6)]
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
