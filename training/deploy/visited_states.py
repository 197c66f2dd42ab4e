"""States that a policy visits: the export calibrates on some and compares its code on others."""

import csv
import io
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controllers.base import Controller
from epv_env.observation import LAYOUT, decode
from training.evaluation.rollout import begin_episodes, make_env

PLANTS = "ten_percent"
SCENARIO = "mixed"
"""Where the policy is followed: every scenario, the calibrated parameters within ±10 %."""

READINGS = ("p1", "p2", "p3", "current", "target", "coil")
"""Readings of an electronic control unit at the end of a period, in the order of the C structures."""


@dataclass(frozen=True, kw_only=True)
class VisitedStates:
    """Episodes under a controller, each from its start, one state for each control period."""

    observations: NDArray
    """(episodes, periods, entries) float32"""
    actions: NDArray
    """(episodes, periods), what the controller decided on them"""

    @property
    def flat(self) -> NDArray:
        """All observations (episodes · periods, entries), episode after episode."""
        return self.observations.reshape(-1, self.observations.shape[-1])


def visit(controller: Controller, *, first_seed: int, episodes: int, periods: int) -> VisitedStates:
    """Follow a controller through seeded episodes."""
    env = make_env(controller, episodes, scenario=SCENARIO, parameters=PLANTS)
    observation = begin_episodes(env, controller, list(range(first_seed, first_seed + episodes)))
    observations, actions = [], []
    for _ in range(periods):
        action = controller.act(observation)
        observations.append(observation)
        actions.append(action)
        observation = env.task.step(*env.action.decode(action)).observation
    return VisitedStates(observations=np.stack(observations, axis=1), actions=np.stack(actions, axis=1))


def readings_of(observations: NDArray) -> dict[str, NDArray]:
    """The readings behind observations (..., entries), float32, in bar, A and 0 or 1, by READINGS."""
    wide = observations.astype(np.float64)
    target = decode(wide, "target")
    values = {
        "p1": decode(wide, "p1"),
        "p2": decode(wide, "p2_error") + target,
        "p3": decode(wide, "p3"),
        "current": decode(wide, "I"),
        "target": target,
        "coil": np.rint(decode(wide, "action")),
    }
    return {name: values[name].astype(np.float32) for name in READINGS}


def states_table(states: VisitedStates, margins: NDArray, fixed_actions: NDArray) -> str:
    """states.csv: episode, readings, observation, and what the policy and the integer code decide.

    margins: (episodes, periods) the policy's logit of on minus that of off.
    """
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(
        ["episode", *READINGS, *(quantity.name for quantity in LAYOUT),
         "policy_action", "policy_margin", "fixed_action"]
    )  # fmt: skip
    readings = readings_of(states.observations)
    for e, k in np.ndindex(states.actions.shape):
        numbers = [*(readings[name][e, k] for name in READINGS), *states.observations[e, k]]
        written = (f"{number:.9g}" for number in numbers)  # nine digits give a float back to the bit
        decided = (states.actions[e, k], f"{margins[e, k]:.9g}", fixed_actions[e, k])
        writer.writerow([e, *written, *decided])
    return stream.getvalue()
