"""The start of an episode: what is drawn, and how each condition that it meets changes it."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import BAR
from epv_env.conditions import PROBABILITIES, Conditions
from epv_env.plant.consumption import SCENARIOS, SILENT, Profile, draw_profile
from epv_env.plant.effects.registry import EFFECTS
from epv_env.plant.parameters import Parameters
from epv_env.plant.region import Region
from epv_env.plant.supply import Supply
from epv_env.settings import Settings
from epv_env.signals import MovingTarget, RecordedConsumption

TARGET_STEPS = 4
"""Steps that a target may take in an episode, besides a MovingTarget."""


@dataclass(frozen=True, kw_only=True)
class Start:
    """Everything random about one episode but its noise."""

    parameters: Parameters
    """Of the plant."""
    region: Region
    """That the plant was drawn from."""
    p1: float
    """First pressure of the supply [Pa absolute]."""
    p2: float
    """First circuit pressure [Pa absolute]."""
    p3: float
    """First control pressure [Pa absolute]."""
    target: float
    """Target pressure [bar absolute]."""
    consumption: Profile
    """Consumption of the whole episode."""
    noise: np.random.Generator
    """Of the sensors."""
    supply: Supply
    """Where the air comes from."""
    moving_target: MovingTarget | None
    """What changes the target; None: it stays."""
    recorded_consumption: RecordedConsumption | None
    """What is drawn instead of `consumption`; None: nothing."""
    seed: int
    """Of all random streams of the episode."""
    coil: bool = True
    """Whether the coil is on at the start."""
    noise_factor: float = 1.0
    """On the settings' noise of the sensors [-]."""
    p3_frozen_at: float = np.inf
    """When the reading of p3 stops changing [s]."""
    target_steps_at: NDArray = field(default_factory=lambda: np.full(TARGET_STEPS, np.inf))
    """When the target steps, increasing (TARGET_STEPS,) [s]; infinite: never."""
    target_steps_to: NDArray = field(default_factory=lambda: np.zeros(TARGET_STEPS))
    """To which value, (TARGET_STEPS,) [bar absolute]."""

    @classmethod
    def draw(cls, rng: np.random.Generator, settings: Settings) -> "Start":
        """Draw an episode; rng gives one seed, from which the three streams of the episode come."""
        seed = int(rng.integers(2**63))
        plant, disturbance, noise = (np.random.default_rng((seed, stream)) for stream in range(3))
        region = settings.plants.chosen(plant)
        p1 = settings.supply.draw(disturbance)
        target = disturbance.uniform(*settings.first_target)
        drop = disturbance.uniform(*settings.drop_bar)
        scenario = settings.scenario
        recorded = scenario if isinstance(scenario, RecordedConsumption) else None
        consumption = (
            SILENT if isinstance(scenario, RecordedConsumption) else draw_profile(scenario, disturbance)
        )
        # Draws that only some settings need come last: they must not shift the others.
        p2 = target - drop if settings.p2_bar is None else disturbance.uniform(*settings.p2_bar)
        p3 = p1 if settings.p3_bar is None else disturbance.uniform(*settings.p3_bar) * BAR
        return cls(
            parameters=region.draw(plant), region=region,
            p1=p1, p2=p2 * BAR, p3=p3, target=target,
            consumption=consumption,
            noise=noise,
            supply=settings.supply,
            moving_target=settings.target_bar if isinstance(settings.target_bar, MovingTarget) else None,
            recorded_consumption=recorded,
            seed=seed,
        )  # fmt: skip


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
            rng = np.random.default_rng((start.seed, STREAM, k))
            start = replace(start, **_CHANGES[name](start, conditions, rng))
    return start


def _starved(start: Start, c: Conditions, rng: np.random.Generator) -> dict[str, Any]:
    """p1 near the target, and p2 no higher than p1: the valve would let it back."""
    p1 = max(start.target - rng.uniform(*c.starved_bar), c.least_p2_bar)
    supply = Supply.starved(p1, refill_s=rng.uniform(*c.starved_s))
    return {"supply": supply, "p1": p1 * BAR, "p3": p1 * BAR, "p2": min(start.p2, p1 * BAR)}


def _far(start: Start, c: Conditions, rng: np.random.Generator) -> dict[str, Any]:
    full = max(min(start.target, start.p1 / BAR), c.least_p2_bar)
    return {"p2": rng.uniform(c.least_p2_bar, full) * BAR}


def _vented(start: Start, c: Conditions, rng: np.random.Generator) -> dict[str, Any]:
    p2 = max(start.target - rng.uniform(*c.vented_drop_bar), c.least_p2_bar) * BAR
    return {"p2": min(p2, start.p1), "p3": start.parameters["p_env"], "coil": False}


def _target_steps(start: Start, c: Conditions, rng: np.random.Generator) -> dict[str, Any]:
    """Steps of the target that the refilled supply can reach."""
    at = np.cumsum(rng.uniform(*c.target_step_s, TARGET_STEPS))
    to = start.target + np.cumsum(rng.uniform(*c.target_step_bar, TARGET_STEPS))
    reachable = max(start.supply.lasting / BAR, start.target)
    return {"target_steps_at": at, "target_steps_to": np.clip(to, c.least_p2_bar, reachable)}


def _worn(start: Start, c: Conditions, rng: np.random.Generator) -> dict[str, Any]:
    count = rng.integers(1, c.most_effects, endpoint=True)
    chosen = rng.choice(len(WORN), size=count, replace=False)
    sizes = {size.symbol: size.draw(rng, size.mild) for k in chosen for size in WORN[k]}
    return {"parameters": start.parameters.replace(**sizes)}


_CHANGES: dict[str, Callable[[Start, Conditions, np.random.Generator], dict[str, Any]]] = {
    "starved": _starved,
    "far": _far,
    "vented": _vented,
    "coil_off": lambda start, c, rng: {"coil": False},
    "rest": lambda start, c, rng: {
        "consumption": start.consumption.later(float(np.exp(rng.uniform(*np.log(c.rest_s)))))
    },
    "target_steps": _target_steps,
    "noisy": lambda start, c, rng: {"noise_factor": rng.uniform(*c.noise_factor)},
    "frozen_p3": lambda start, c, rng: {"p3_frozen_at": rng.uniform(*c.frozen_p3_s)},
    "worn": _worn,
    "biased_p2": lambda start, c, rng: {
        "parameters": start.parameters.replace(b_p2=rng.uniform(*c.bias_p2_bar) * BAR)
    },
    "delayed": lambda start, c, rng: {
        "parameters": start.parameters.replace(t_delay=rng.uniform(*c.delay_ms) * 1e-3)
    },
    "extreme": lambda start, c, rng: {"parameters": start.region.towards_ends(start.parameters)},
    "braking": lambda start, c, rng: {
        "consumption": SCENARIOS["emergency"].draw(rng), "recorded_consumption": None
    },
}  # fmt: skip
"""Fields of the start that a condition changes, by the name of its probability."""
