"""The oracle finds what an exhaustive search finds, foresees what happens, and disturbs nothing."""

from itertools import product

import numpy as np
import pytest

from controllers.oracle import Oracle
from controllers.oracle_search import Search
from controllers.tuned import tuned_controllers
from epv_env.reward import RewardWeights
from epv_env.vector_env import EPValveVectorEnv

READY = {"target_bar": 8.0, "p2_bar": 7.95, "p3_bar": 7.4, "supply": 12.0}


def begun(n, seeds=None, **options):
    """An environment of n valves at its start, and its first observation."""
    env = EPValveVectorEnv(n, autoreset_mode="Disabled", threads=1, **options)
    return env, env.reset(seed=seeds or list(range(n)))[0]


def played(env, moves):
    """Rewards (steps, n) of moves (steps, n)."""
    return np.array([env.task.step(*env.action.decode(move)).reward for move in moves])


def test_it_finds_the_best_of_all_1024_sequences():
    """From a control pressure that is nearly low enough to open, ten periods decide a lot."""
    everything = np.array(list(product([0, 1], repeat=10)))
    env, _ = begun(len(everything), [7] * len(everything), scenario="steps", **READY)
    prices = -played(env, everything.T).sum(axis=0)
    assert prices.max() > 1.5 * prices.min()  # there is something to find
    for width, within in ((64, 0.01), (1024, 0.002)):
        search = Search(begun(1, [7], scenario="steps", **READY)[0].task, width, 1)
        for _ in range(10):
            search.expand()
        assert search.nodes.price.min() <= prices.min() * (1 + within)


def test_what_it_foresees_comes_true():
    """The price of the best node is what its moves then cost, with compressor, sag and consumption."""
    env, _ = begun(3, scenario="pumping", parameters="ten_percent")
    search = Search(env.task, 32, 1)
    for _ in range(60):
        search.expand()
    best = search.nodes.price.argmin(axis=1)
    foreseen = search.nodes.price[np.arange(3), best]
    bits = search.nodes.moves[np.arange(3), best]
    moves = [(bits >> np.uint64(59 - k)) & np.uint64(1) for k in range(60)]
    np.testing.assert_allclose(-played(env, moves).sum(axis=0), foreseen, rtol=1e-12)


def test_it_does_not_disturb_what_it_watches():
    watched, observation = begun(2, scenario="service")
    oracle = Oracle(width=8, look_ahead=20, threads=1)
    oracle.watch(watched.task)
    moves, rewards = [], []
    for _ in range(60):
        moves.append(oracle.act(observation))
        result = watched.task.step(*watched.action.decode(moves[-1]))
        observation = result.observation
        rewards.append(result.reward)
    np.testing.assert_array_equal(played(begun(2, scenario="service")[0], moves), rewards)


def test_each_episode_of_a_batch_is_decided_as_it_would_be_alone():
    decided = []
    for n in (3, 1):
        env, observation = begun(n)
        oracle = Oracle(width=16, look_ahead=20, threads=1)
        oracle.watch(env.task)
        moves = []
        for _ in range(60):
            moves.append(oracle.act(observation))
            env.task.step(*env.action.decode(moves[-1]))
        decided.append(np.array(moves)[:, 0])
    np.testing.assert_array_equal(*decided)
    assert np.ptp(decided[0]) == 1


def test_it_avoids_what_its_own_prices_say():
    """Prices of its own decide as the task's would; where switching is free it switches more."""
    free = RewardWeights(switching=0.0)
    cases = {"given": (free, {}), "the task's": (None, {"weights": free}), "usual": (None, {})}
    decided = {}
    for case, (weights, options) in cases.items():
        env, observation = begun(2, scenario="steps", **READY, **options)
        oracle = Oracle(width=16, look_ahead=20, threads=1, weights=weights)
        oracle.watch(env.task)
        moves = []
        for _ in range(100):
            moves.append(oracle.act(observation))
            observation = env.task.step(*env.action.decode(moves[-1])).observation
        decided[case] = np.array(moves)
    np.testing.assert_array_equal(decided["given"], decided["the task's"])
    switchings = {case: np.abs(np.diff(moves, axis=0)).sum() for case, moves in decided.items()}
    assert switchings["given"] > 2 * switchings["usual"]


def test_foresight_beats_the_tuned_hysteresis():
    hysteresis = next(c for c in tuned_controllers() if c.name == "hysteresis, extrapolating")
    returns = []
    for controller in (Oracle(width=64, threads=1), hysteresis):
        env, observation = begun(2, [100, 101], scenario="steps", drop_bar=(0.0, 0.2))
        controller.reset(2)
        if isinstance(controller, Oracle):
            controller.watch(env.task)
        total = np.zeros(2)
        for _ in range(300):
            result = env.task.step(*env.action.decode(controller.act(observation)))
            observation = result.observation
            total += result.reward
        returns.append(total)
    assert np.all(returns[0] > returns[1])


def test_what_it_cannot_do_it_says():
    with pytest.raises(ValueError, match="call watch"):
        Oracle().act(np.zeros((1, 13)))
    with pytest.raises(ValueError, match="1 to 64"):
        Oracle(look_ahead=65)
    env, observation = begun(1, parameters={"t_delay": 5e-3})
    oracle = Oracle()
    oracle.watch(env.task)
    with pytest.raises(ValueError, match="t_delay = 0"):
        oracle.act(observation)
