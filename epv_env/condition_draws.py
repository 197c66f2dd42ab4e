"""How each condition changes the start of an episode (`epv_env.conditions`)."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from epv_env.common.units import BAR
from epv_env.conditions import PROBABILITIES, Conditions
from epv_env.episode import TARGET_STEPS, Start
from epv_env.plant.consumption import SCENARIOS
from epv_env.plant.effects.registry import EFFECTS
from epv_env.plant.supply import Supply

STREAM = 3
"""Of the episode's seed: the plant, the disturbance and the noise have 0 to 2."""

WORN = tuple(sizes for effect in EFFECTS for sizes in effect.drawn)
"""Sizes that act together, of every effect of valve, sensors and timing that has a typical size."""


def under_conditions(start: Start, conditions: Conditions) -> Start:
    """The start under the conditions that it meets, drawn from its seed.

    What one condition draws does not depend on the others' probabilities.
    """
    if conditions.ordinary:
        return start
    chances = np.random.default_rng((start.seed, STREAM)).random(len(PROBABILITIES))
    for k, (name, chance) in enumerate(zip(PROBABILITIES, chances, strict=True)):
        if chance < getattr(conditions, name):
            start = _CHANGES[name](start, conditions, np.random.default_rng((start.seed, STREAM, k)))
    return start


def _starved(start: Start, c: Conditions, rng: np.random.Generator) -> Start:
    """p1 near the target, and p2 no higher than p1: the valve would let it back."""
    p1 = max(start.target - rng.uniform(*c.starved_bar), c.least_p2_bar)
    supply = Supply.starved(p1, refill_s=rng.uniform(*c.starved_s))
    return replace(start, supply=supply, p1=p1 * BAR, p3=p1 * BAR, p2=min(start.p2, p1 * BAR))


def _far(start: Start, c: Conditions, rng: np.random.Generator) -> Start:
    full = max(min(start.target, start.p1 / BAR), c.least_p2_bar)
    return replace(start, p2=rng.uniform(c.least_p2_bar, full) * BAR)


def _vented(start: Start, c: Conditions, rng: np.random.Generator) -> Start:
    p2 = max(start.target - rng.uniform(*c.vented_drop_bar), c.least_p2_bar) * BAR
    return replace(start, p2=min(p2, start.p1), p3=start.parameters["p_env"], coil=False)


def _coil_off(start: Start, c: Conditions, rng: np.random.Generator) -> Start:
    return replace(start, coil=False)


def _rest(start: Start, c: Conditions, rng: np.random.Generator) -> Start:
    later = float(np.exp(rng.uniform(*np.log(c.rest_s))))
    return replace(start, consumption=start.consumption.later(later))


def _target_steps(start: Start, c: Conditions, rng: np.random.Generator) -> Start:
    """Steps of the target that the refilled supply can reach."""
    at = np.cumsum(rng.uniform(*c.target_step_s, TARGET_STEPS))
    to = start.target + np.cumsum(rng.uniform(*c.target_step_bar, TARGET_STEPS))
    reachable = max(start.supply.lasting / BAR, start.target)
    return replace(start, target_steps_at=at, target_steps_to=np.clip(to, c.least_p2_bar, reachable))


def _noisy(start: Start, c: Conditions, rng: np.random.Generator) -> Start:
    return replace(start, noise_factor=rng.uniform(*c.noise_factor))


def _frozen_p3(start: Start, c: Conditions, rng: np.random.Generator) -> Start:
    return replace(start, p3_frozen_at=rng.uniform(*c.frozen_p3_s))


def _worn(start: Start, c: Conditions, rng: np.random.Generator) -> Start:
    count = rng.integers(1, c.most_effects, endpoint=True)
    chosen = rng.choice(len(WORN), size=count, replace=False)
    sizes = {size.symbol: size.draw(rng, size.mild) for k in chosen for size in WORN[k]}
    return replace(start, parameters=start.parameters.replace(**sizes))


def _biased_p2(start: Start, c: Conditions, rng: np.random.Generator) -> Start:
    bias = rng.uniform(*c.bias_p2_bar) * BAR
    return replace(start, parameters=start.parameters.replace(b_p2=bias))


def _delayed(start: Start, c: Conditions, rng: np.random.Generator) -> Start:
    delay = rng.uniform(*c.delay_ms) * 1e-3
    return replace(start, parameters=start.parameters.replace(t_delay=delay))


def _extreme(start: Start, c: Conditions, rng: np.random.Generator) -> Start:
    return replace(start, parameters=start.region.towards_ends(start.parameters))


def _braking(start: Start, c: Conditions, rng: np.random.Generator) -> Start:
    return replace(start, consumption=SCENARIOS["emergency"].draw(rng), recorded_consumption=None)


_CHANGES: dict[str, Callable[[Start, Conditions, np.random.Generator], Start]] = {
    "starved": _starved, "far": _far, "vented": _vented, "coil_off": _coil_off, "rest": _rest,
    "target_steps": _target_steps, "noisy": _noisy, "frozen_p3": _frozen_p3, "worn": _worn,
    "biased_p2": _biased_p2, "delayed": _delayed, "extreme": _extreme, "braking": _braking,
}  # fmt: skip
"""By the name of the probability."""
