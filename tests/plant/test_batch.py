"""A valve's trajectory does not depend, to the bit, on its companions, its place or the threads."""

from typing import Any

import numpy as np
import pytest

from epv_env.common.law_form import KNOTS
from epv_env.plant.effects.law import placed
from epv_env.plant.effects.registry import PLACES
from epv_env.plant.equations import Inputs, State
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves

PERIOD = 5e-3
N = 100


def fleet(effects=False):
    """Parameters and starting states of N valves that all differ, fields of shape (N,)."""
    rng = np.random.default_rng(2)
    p: dict[str, Any] = dict(Parameters.nominal() if effects else Parameters.calibrated())
    for symbol in ("alphaMV", "alphaPV", "R", "RML", "V3", "mMV"):
        p[symbol] = p[symbol] * rng.uniform(0.9, 1.1, N)
    p["eMV"] = rng.choice([0.0, 0.6], N)
    start = energised(p, p1=12e5, p2=0.0, U=24.0)
    return p, start._replace(p2=rng.uniform(5e5, 8e5, N))


def inputs(periods=60):
    """Random switching and consumption, fields of shape (periods, N)."""
    rng = np.random.default_rng(3)
    off = np.cumsum(rng.random((periods, N)) < 0.15, axis=0) % 2 == 1
    zeros = np.zeros((periods, N))
    consumed = rng.uniform(0, 2e-3, (periods, N))
    return Inputs(np.where(off, 0.0, 24.0), consumed, *[zeros] * 5)


def run(fleet, u, members, threads=1):
    """States of these members after each period, in one batch; array (field, period, member)."""
    p, start = fleet
    members = np.asarray(members)
    chosen = {key: value[members] if np.ndim(value) else value for key, value in p.items()}
    first = State(*(np.broadcast_to(value, N)[members] for value in start))
    valves = Valves.started(len(members), chosen, first, threads=threads)
    return np.array(valves.record(Inputs(*(field[:, members] for field in u)), PERIOD))


@pytest.fixture(scope="module", params=[False, True], ids=["nominal kernel", "extended kernel"])
def case(request):
    """(fleet, inputs, every valve's trajectory in a batch of its own)."""
    valves, u = fleet(request.param), inputs()
    alone = np.concatenate([run(valves, u, [k]) for k in range(N)], axis=2)
    return valves, u, alone


@pytest.mark.parametrize("size", [5, 17])
def test_trajectory_is_the_same_alone_and_in_any_batch(case, size):
    valves, u, alone = case
    np.testing.assert_array_equal(run(valves, u, np.arange(size)), alone[:, :, :size])


def test_trajectory_is_the_same_at_any_place(case):
    valves, u, alone = case
    order = np.random.default_rng(4).permutation(N)
    np.testing.assert_array_equal(run(valves, u, order), alone[:, :, order])


def test_trajectory_is_the_same_with_any_number_of_threads(case):
    valves, u, _ = case
    many = np.tile(np.arange(N), 4)
    np.testing.assert_array_equal(run(valves, u, many, threads=2), run(valves, u, many, threads=1))


def test_a_valve_that_fails_leaves_its_companions_alone(case):
    valves, u, alone = case
    p, start = valves
    p3 = np.full(N, start.p3)
    p3[7] = np.nan
    few = Inputs(*(field[:10] for field in u))
    found = run((p, start._replace(p3=p3)), few, np.arange(16))
    assert np.isnan(State(*found).p3[-1, 7])
    others = np.delete(np.arange(16), 7)
    np.testing.assert_array_equal(found[:, :, others], alone[:, :10, others])


def test_advance_and_record_are_the_same():
    (p, start), u = fleet(), inputs(20)
    valves = Valves.started(N, p, start)
    for period in range(20):
        for field, value in zip(valves.inputs, u, strict=True):
            field[:] = value[period]
        valves.advance(PERIOD)
    recorded = run((p, start), u, np.arange(N))
    np.testing.assert_array_equal(np.array(valves.state), recorded[:, -1])


def test_extremes_are_those_of_the_trajectory():
    """Against states recorded every 25 us: no step on trial that was given up leaves a trace."""
    valves, u = Valves.started(N, *fleet()), inputs(20)
    q = valves.record(Inputs(*(np.repeat(field, 200, axis=0) for field in u)), PERIOD / 200)
    lowest, highest = valves.tables.lowest[:N], valves.tables.highest[:N]
    np.testing.assert_allclose(highest, q.p2.max(axis=0), rtol=0, atol=5.0)
    np.testing.assert_allclose(lowest, q.p2.min(axis=0), rtol=0, atol=5.0)
    assert np.all(highest >= q.p2.max(axis=0))


def test_trajectory_is_the_same_beside_valves_with_other_effects():
    (p, start), u = fleet(), inputs()
    law = placed(3, PLACES["local_gas_speed"], "p2", 5e5, 9e5, (0.5,) * KNOTS)
    others = [{**law, "law3_effect": 0.0}, {**law, "law3_effect": 0.0, "a2": 2e-4}, {**law, "a2": 2e-4}]
    group = np.arange(N) % len(others)
    own = {s: np.array([each.get(s, 0.0) for each in others])[group] for s in others[-1]}
    mixed = run(({**p, **own}, start), u, np.arange(N))
    for number, each in enumerate(others):
        same = run(({**p, **each}, start), u, np.arange(N))
        np.testing.assert_array_equal(mixed[:, :, group == number], same[:, :, group == number])


def test_a_valve_that_was_given_up_is_not_tried_again():
    """Trying the 499 later periods of a valve whose mass is NaN as well would take minutes."""
    p = {**Parameters.calibrated(), "mMV": np.array([2e-3, np.nan])}
    valves = Valves.started(2, p, energised(p, p1=12e5, p2=6e5, U=24.0))
    later = valves.record(Inputs(*np.zeros((7, 500, 1))), 5e-4)
    assert np.all(np.isfinite(later.p2[:, 0]))
    assert np.all(np.isnan(later.p2[:, 1]))
