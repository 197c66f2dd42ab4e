"""How long a step the integrator may take with effects that are steep or fast."""

import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.effects import law
from epv_env.plant.effects.coil import CLAMP_WIDTH, NO_CURRENT, OFF_VOLTAGE
from epv_env.plant.effects.magnet import inverse_inductance
from epv_env.plant.effects.movers import SLIDING_SPEED_MV, SLIDING_SPEED_PV
from epv_env.plant.effects.record import Constant, Effect
from epv_env.plant.primitives import inlined

STABLE = 1.0
"""Longest step times fastest rate at which the integrator follows an effect well [-]."""

FRICTION_STABLE = 0.35
"""The same for friction near rest, where its rate falls steeply with speed [-]."""

UNLIMITED = 1.0
"""Longest step where no effect asks for a shorter one [s]."""


def step_limits(effects: tuple[Effect, ...]) -> tuple[Constant, ...]:
    """The longest steps as further constants of the kernel [s]."""

    places = {effect.name: place for place, effect in enumerate(effects, start=1)}

    def steady_step(p: Mapping[str, NDArray]) -> NDArray:
        fastest = np.full_like(p["s_pipe"], STABLE / UNLIMITED)
        for effect in effects:
            if effect.fastest_rate:
                growth = law.most_growth(p, places[effect.name])
                fastest = np.maximum(fastest, effect.fastest_rate(p) * growth)
        return STABLE / fastest

    def step(
        rate: Callable[[Mapping[str, NDArray]], NDArray], stable: float, name: str
    ) -> Callable[..., NDArray]:
        """For a rate [1/s] that a law of an effect may raise."""
        return lambda p: (
            stable / np.maximum(rate(p) * law.most_growth(p, places[name]), STABLE / UNLIMITED)
        )

    return (
        # for all effects but clamp and friction
        Constant("steady_step", steady_step, is_size=False),
        Constant("clamp_step", step(_clamp_rate, STABLE, "flyback_voltage"), is_size=False),
        # for the friction of a mover about to stop
        Constant(
            "slow_step_PV", step(_friction_rate_PV, FRICTION_STABLE, "piston_friction"), is_size=False
        ),
        Constant(
            "slow_step_MV", step(_friction_rate_MV, FRICTION_STABLE, "armature_friction"), is_size=False
        ),
    )


def _clamp_rate(p: Mapping[str, NDArray]) -> NDArray:
    """Rate of the current's decay against a clamp near zero current [1/s]."""
    return p["U_clamp"] / CLAMP_WIDTH * inverse_inductance(p)


def _friction_rate_PV(p: Mapping[str, NDArray]) -> NDArray:
    """Rate at which friction stops the piston [1/s]."""
    return p["F_PV"] * (1 + p["S_PV"]) / (p["mPV"] * SLIDING_SPEED_PV)


def _friction_rate_MV(p: Mapping[str, NDArray]) -> NDArray:
    """Rate at which friction stops the armature [1/s]."""
    return p["F_MV"] / (p["mMV"] * SLIDING_SPEED_MV)


@inlined
def friction_step(slow_step, v, sliding_speed):
    """Longest step for friction at a speed [s]: the slope of the curve of `friction` falls with it.

    Half the speed stands for what a step may take from it; nor may friction turn a mover within one.
    """
    relative = abs(v) / sliding_speed
    steeper = 1.0 + 0.25 * relative * relative
    return slow_step * min(steeper * math.sqrt(steeper), 1.0 + 0.5 * relative)


@inlined
def longest_step(U, q, effects, free_PV, free_MV):
    """Longest step that the effects allow at present [s]; friction asks for none while a stop holds."""
    clamped = (U <= OFF_VOLTAGE) & (abs(q.I) > NO_CURRENT)
    step = min(effects.steady_step, effects.clamp_step if clamped else effects.steady_step)
    step_PV = friction_step(effects.slow_step_PV, q.vPV, SLIDING_SPEED_PV)
    step_MV = friction_step(effects.slow_step_MV, q.vMV, SLIDING_SPEED_MV)
    step = min(step, step_PV if free_PV > 0.0 else step)
    return min(step, step_MV if free_MV > 0.0 else step)
