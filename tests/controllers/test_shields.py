"""The shields of the learned policy hold on any readings, and its network's answers are numbers."""

import numpy as np

from controllers.knowledge import ValveKnowledge, forced, keeps_on
from controllers.policy import load_policy
from controllers.valve_learner import LEARNT
from epv_env.observation import INDEX, LAYOUT, LIMIT, decode, encode
from epv_env.plant.plantfile import Plant


def random_observations(n, rng):
    """Observations with nothing in common but the box of the 13 readings, all near the band."""
    seen = LIMIT * rng.uniform(-1.0, 1.0, (n, len(LAYOUT)))
    seen[:, INDEX["p2_error"]] = rng.uniform(-3.0, 3.0, n)
    seen[:, INDEX["target"]] = rng.uniform(-0.5, 0.5, n)
    seen[:, INDEX["action"]] = rng.choice([-1.0, 1.0], n)
    return seen.astype(np.float32)


def outside(seen):
    """Whether p2 lies above the band, and whether shield 4 is asked for, (n,) each."""
    error, target, p1, p3, coil = (
        decode(seen, name) for name in ("p2_error", "target", "p1", "p3", "action")
    )
    ready = (coil > 0.5) & (p1 - error - target >= 1.0) & (p1 - p3 <= 0.5)
    return error >= 0.5, (error <= -0.5) & ready


def test_no_reading_opens_above_the_band_or_keeps_shut_below_it_and_without_shields_some_do():
    rng = np.random.default_rng(0)
    controller, knowledge = load_policy(), ValveKnowledge(Plant.calibrated())
    controller.reset(500)
    knowledge.reset(500)
    without = {"above": 0, "opened": 0, "below": 0, "stayed shut": 0}
    for _ in range(20):
        seen = random_observations(500, rng)
        above, below = outside(seen)
        off, on = controller.network.logits(knowledge.observe(seen)).T
        ruled = np.array([keeps_on(v) for v in knowledge.valves]) | (knowledge.valves["found_open"] > 0)
        bare = np.where(ruled | ~(off >= on), 1, 0)
        forces = np.array(
            [
                forced(v, error)
                for v, error in zip(knowledge.valves, decode(seen, "p2_error"), strict=True)
            ]
        )
        shielded = np.where(forces > 0, 1, np.where(forces < 0, 0, bare))
        assert np.all(shielded[above] == 1)
        assert np.all(shielded[below & ~ruled] == 0)
        counts = above, above & (bare == 0), below & ~ruled, below & ~ruled & (bare == 1)
        for name, which in zip(without, counts, strict=True):
            without[name] += int(which.sum())
        lost = rng.random(seen.shape) < 0.01
        seen[lost] = rng.choice([np.nan, np.inf, -np.inf], lost.sum())
        actions = controller.act(seen)
        assert set(actions) <= {0, 1}
        error = decode(seen, "p2_error")
        assert np.all(actions[(error >= 0.5) & np.isfinite(error + decode(seen, "target"))] == 1)
    assert min(without.values()) > 0


def test_a_valve_that_is_found_open_is_shut_for_as_long_as_that_takes_and_another_is_not():
    controller = load_policy()
    usual = {entry.name: np.full(2, entry.centre) for entry in LAYOUT}
    usual |= {"p1": np.full(2, 11.0), "target": np.full(2, 8.0), "p2_error": np.full(2, -3.5)}
    usual |= {"p3": np.array([1.0, 11.0])}
    controller.reset(2)
    coil, taken = np.array([0.0, 1.0]), []
    for _ in range(12):
        coil = controller.act(encode(usual | {"action": coil}))
        taken.append(coil)
    assert [found for found, _ in taken] == 10 * [1] + [0, 0]
    assert taken[0][1] == 0


def test_no_input_of_the_box_makes_a_logit_that_is_no_number():
    """Interval arithmetic (Moore, Interval Analysis, 1966): sound bounds of every layer."""
    network = load_policy().network
    box = np.array([quantity.limit for quantity in (*LAYOUT, *LEARNT)])
    low, high = -box, box
    for weight, bias in network.layers:
        middle, reach = weight @ (low + high) / 2 + bias, np.abs(weight) @ (high - low) / 2
        assert np.all(np.abs(middle) + reach < 1e3)
        low, high = np.tanh(middle - reach), np.tanh(middle + reach)
    assert np.all(np.isfinite(network.advice_weight))
