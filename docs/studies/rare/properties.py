"""What no reading can make the controller do: counterexamples without the shields, and bounds."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.knowledge import cannot_raise, would_rise_too_far
from controllers.policy import Policy, load_policy
from controllers.policy_files import Network
from controllers.valve_learner import LEARNT
from epv_env.observation import CENTRE, INDEX, LAYOUT, LIMIT, SCALE, decode

BOX = np.array([quantity.limit for quantity in (*LAYOUT, *LEARNT)])
"""Largest magnitude of each of the 34 inputs [-]: observation and learner clip them."""
PERIODS = 20
"""Random readings that an episode of `random_observations` has."""


def logit_bounds(network: Network) -> tuple[NDArray, NDArray]:
    """Bounds (2,) that the logits keep on the whole box of inputs, by interval arithmetic.

    Sound up to rounding: every layer's bounds hold for all inputs of the layer before (Moore,
    Interval Analysis, 1966).
    """
    low, high = -BOX, BOX
    for k, (weight, bias) in enumerate(network.layers):
        middle, reach = weight @ (low + high) / 2 + bias, np.abs(weight) @ (high - low) / 2
        low, high = middle - reach, middle + reach
        if k + 1 < len(network.layers):
            low, high = np.tanh(low), np.tanh(high)
    advice = np.abs(network.advice_weight) * BOX[-1]
    return low - advice, high + advice


def random_observations(n: int, rng: np.random.Generator) -> NDArray:
    """Observations (n, readings) with nothing in common but the box, half of them close to the band."""
    seen = LIMIT * rng.uniform(-1.0, 1.0, (n, len(LAYOUT)))
    near = rng.random(n) < 0.5
    seen[near, INDEX["p2_error"]] = rng.uniform(-3.0, 3.0, near.sum())
    seen[:, INDEX["target"]] = (rng.uniform(5.0, 11.0, n) - CENTRE[INDEX["target"]]) / SCALE[
        INDEX["target"]
    ]
    seen[:, INDEX["action"]] = rng.choice([-1.0, 1.0], n)
    return seen.astype(np.float32)


def without_shields(policy: Policy, observations: NDArray) -> NDArray:
    """What network and rules alone decide for the observations taken in next, (n,)."""
    inputs = policy.knowledge.observe(observations)
    off, on = policy.network.logits(inputs).T
    ruled = [cannot_raise(v) or would_rise_too_far(v) for v in policy.knowledge.learner.valves]
    return np.where(np.array(ruled) | ~(off >= on), 1, 0)


def counterexamples(episodes: int = 1000, seed: int = 0) -> dict[str, Any]:
    """How often network and rules alone open above the band, and stay shut below it.

    Random readings in a row, `episodes` valves. Also the first observation above the band that opens.
    """
    rng = np.random.default_rng(seed)
    policy: Any = load_policy().main
    policy.reset(episodes)
    counts = dict.fromkeys(("above", "opened", "below", "stayed shut"), 0)
    example = None
    for _ in range(PERIODS):
        seen = random_observations(episodes, rng)
        actions = without_shields(policy, seen)
        error, p1, p3 = (decode(seen, name) for name in ("p2_error", "p1", "p3"))
        head = p1 - error - decode(seen, "target")
        above = error >= 0.5
        below = (error <= -0.5) & (decode(seen, "action") > 0.5) & (head >= 1.0) & (p1 - p3 <= 0.5)
        counts["above"] += int(above.sum())
        counts["opened"] += int((above & (actions == 0)).sum())
        counts["below"] += int(below.sum())
        counts["stayed shut"] += int((below & (actions == 1)).sum())
        if example is None and np.any(above & (actions == 0)):
            row = seen[np.argmax(above & (actions == 0))]
            example = {entry.name: round(float(decode(row, entry.name)), 3) for entry in LAYOUT}
    return {**counts, "example": example}
