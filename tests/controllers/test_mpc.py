"""The MPC foresees what the plant then does, and does better for it than a tuned hysteresis."""

import numpy as np
import pytest

from controllers.estimator import StateEstimate
from controllers.mpc import MPC
from controllers.mpc_prediction import PREDICTION, Decision, Predictor, sequences
from controllers.tuned import build, load_tunings
from epv_env.plant.equations import State
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant
from epv_env.reward import RewardWeights
from epv_env.vector_env import EPValveVectorEnv


def begun(n, seeds=None, **options):
    """An environment of n valves at its start, and its first observation."""
    env = EPValveVectorEnv(n, autoreset_mode="Disabled", threads=1, **options)
    return env, env.reset(seed=seeds or list(range(n)))[0]


def test_every_sequence_ends_at_rest_long_enough_to_shut():
    table = sequences()
    assert table.shape[1] == PREDICTION.horizon
    assert np.all(table[0])  # resting is the first
    assert np.all(table[:, -5:])
    assert len(np.unique(table, axis=0)) == len(table)


def test_prices_are_what_the_episodes_then_cost():
    """Every sequence played in an episode of its own, without consumption, from half-vented."""
    table = sequences()
    env, _ = begun(
        len(table),
        [3] * len(table),
        scenario="none",
        supply=12.0,
        target_bar=8.0,
        p2_bar=7.8,
        p3_bar=8.5,
    )
    predictor = Predictor(
        capacity=1, tail=0.0, floor=-np.inf, upkeep=0.0, weights=RewardWeights(), supply_voltage=24.0,
        control_period=5e-3, threads=1,
    )  # fmt: skip
    plant = {symbol: np.array([value]) for symbol, value in Parameters.calibrated().items()}
    estimate = StateEstimate(
        state=State(*(field[:1].copy() for field in env.task.valves.state)),
        consumption=np.zeros(1), fall_rate=np.zeros(1), parameters=plant,
    )  # fmt: skip
    foreseen = predictor.prices(
        Decision(estimate=estimate, target=env.task.target[:1], coil=np.array([True]))
    )
    cost = -sum(env.task.step(*env.action.decode(move)).reward for move in table.T)
    assert np.ptp(cost) > 5  # the sequences differ
    np.testing.assert_allclose(foreseen[0], cost, atol=0.2)  # a pulse's error of 2 mbar for 0.2 s


def test_resting_costs_nothing_more_at_the_target_and_more_the_further_off():
    predictor = Predictor(
        capacity=1, tail=0.1, floor=-0.1, upkeep=10.0, weights=RewardWeights(), supply_voltage=24.0,
        control_period=5e-3, threads=1,
    )  # fmt: skip
    held = predictor._rest(np.array([0.0, 0.1, 0.2]), np.zeros(3))
    assert held[0] == 0
    np.testing.assert_allclose(held[1:], [1.0, 2.0])  # 0.25 per 5 ms and 500 mbar for 100 ms
    below = predictor._rest(np.array([-0.1, -0.2]), np.zeros(2))
    assert below[0] == pytest.approx(0.1 * 10.0)
    assert below[1] > below[0]


def test_each_valve_of_a_batch_is_decided_as_it_would_be_alone():
    decided = []
    for n in (17, 1):  # 17: more than one chunk
        env, observation = begun(n, scenario="steps", drop_bar=(0.0, 0.3))
        controller = MPC(parameters=Parameters.calibrated(), threads=1)
        controller.reset(n)
        moves = []
        for _ in range(60):
            moves.append(controller.act(observation))
            observation = env.task.step(*env.action.decode(moves[-1])).observation
        decided.append(np.array(moves)[:, 0])
    np.testing.assert_array_equal(*decided)
    assert np.ptp(decided[0]) == 1


def test_it_earns_more_than_the_tuned_hysteresis():
    """On plants that it does not know exactly, with all noise."""
    plant = Parameters.calibrated()
    tuned = load_tunings()["hysteresis, extrapolating"]
    returns = []
    for controller in (
        MPC(parameters=plant, threads=1),
        build("hysteresis, extrapolating", tuned.values, Plant.calibrated()),
    ):
        env, observation = begun(4, scenario="service", parameters="ten_percent")
        controller.reset(4)
        total = 0.0
        for _ in range(300):
            result = env.task.step(*env.action.decode(controller.act(observation)))
            observation = result.observation
            total += result.reward.mean()
        returns.append(total)
    assert returns[0] > returns[1]
