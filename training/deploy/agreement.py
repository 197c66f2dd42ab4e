"""Whether compiled code decides as the policy: along visited states, and in closed loop."""

import csv
import ctypes
import io
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.base import Controller
from controllers.knowledge import ValveKnowledge
from controllers.valve_learner import LEARNT
from epv_env.observation import LAYOUT
from training.deploy.c_code import LEAST_AGREEMENT, Export
from training.deploy.compiled import READINGS, CompiledPolicy, logits_of, readings_of
from training.deploy.translation import ExportError
from training.evaluation.metrics import summary
from training.evaluation.rollout import begin_episodes, make_env, run_episodes
from training.evaluation.seeds import CLOSED_LOOP_SEED, STATES_SEED

STATES_EPISODES = 20
"""Episodes whose states the code is compared on."""
STATES_PERIODS = 500
"""Control periods of each of them: 2.5 s; 10,000 states altogether."""
OPTIONS = {"scenario": "mixed", "parameters": "ten_percent"}
"""Where the policy is followed: every scenario, the calibrated parameters within ±10 %."""
FIGURES = ("C1_stayed", "C1_worst_excursion_bar", "rms_error_bar", "switchings_per_s", "mean_return")
"""Figures of the closed loop, of `summary`."""


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


def visit(
    controller: Controller,
    *,
    episodes: int = STATES_EPISODES,
    periods: int = STATES_PERIODS,
    first_seed: int = STATES_SEED,
) -> VisitedStates:
    """Follow a controller through seeded episodes."""
    env = make_env(controller, episodes, **OPTIONS)
    observation = begin_episodes(env, controller, list(range(first_seed, first_seed + episodes)))
    observations, actions = [], []
    for _ in range(periods):
        action = controller.act(observation)
        observations.append(observation)
        actions.append(action)
        observation = env.task.step(*env.action.decode(action)).observation
    return VisitedStates(observations=np.stack(observations, axis=1), actions=np.stack(actions, axis=1))


def inputs_along(export: Export, states: VisitedStates) -> NDArray:
    """The network's inputs (states, all), readings and learnt quantities, along visited states."""
    policy = export.policy
    knowledge = ValveKnowledge(policy.plant, control_period=export.period)
    knowledge.reset(len(states.observations))
    periods = range(states.observations.shape[1])
    inputs = [knowledge.observe(states.observations[:, k]) for k in periods]
    return np.stack(inputs, axis=1).reshape(-1, inputs[0].shape[1])


def margins(export: Export, inputs: NDArray, dtype: type = np.float64) -> NDArray:
    """The network's logit of on minus that of off (states,), computed by Python in this precision."""
    network = export.policy.network
    layers = [(weight.astype(dtype), bias.astype(dtype)) for weight, bias in network.layers]
    advice = network.advice_weight.astype(dtype)
    return _difference(replace(network, layers=layers, advice_weight=advice).logits(inputs))


def _difference(logits: NDArray) -> NDArray:
    """Logit of on minus that of off (...) in double precision, from logits (..., 2)."""
    return logits[..., 1].astype(np.float64) - logits[..., 0]


def follow(controller: Controller, states: VisitedStates) -> NDArray:
    """Decisions (episodes, periods) of a controller along the states that another one visited."""
    controller.reset(len(states.observations))
    periods = range(states.observations.shape[1])
    return np.stack([controller.act(states.observations[:, k]) for k in periods], axis=1)


def agreement(
    export: Export, code: ctypes.CDLL, states: VisitedStates, inputs: NDArray
) -> dict[str, Any]:
    """How the code's decisions compare with the controller's along the states.

    Args:
        export: the controller.
        code: compiled.
        states: visited by the controller.
        inputs: of the network along them (`inputs_along`), (states, all).

    Raises:
        ExportError: they differ on more than 1 - LEAST_AGREEMENT of the states.
    """
    differs = follow(CompiledPolicy(code=code), states) != states.actions
    exact = margins(export, inputs)
    if np.mean(differs) > 1 - LEAST_AGREEMENT:
        raise ExportError(
            f"the C code decides otherwise than the controller on {differs.sum()} of {exact.size} "
            f"states: rounding explains {1 - LEAST_AGREEMENT:.2%}, so the code is wrong"
        )
    return {
        "states": exact.size,
        "agrees": int(np.sum(~differs)),
        "rounding_of_c": float(np.abs(_difference(logits_of(code, inputs)) - exact).max()),
        "rounding_of_python": float(np.abs(margins(export, inputs, np.float32) - exact).max()),
    }


def closed_loop(
    controller: Controller, code: ctypes.CDLL, *, episodes: int, duration: float
) -> dict[str, dict[str, float]]:
    """FIGURES of the controller and of its compiled code on the same episodes, by controller's name."""
    figures = {}
    seeds = list(range(CLOSED_LOOP_SEED, CLOSED_LOOP_SEED + episodes))
    for each in (controller, CompiledPolicy(code=code)):
        metrics = run_episodes(each, seeds=seeds, duration=duration, options=OPTIONS)
        found = summary(metrics)
        figures[each.name] = {name: found[name] for name in FIGURES}
    return figures


def states_table(states: VisitedStates, inputs: NDArray) -> str:
    """states.csv: episode, readings, inputs of the network, and the decision."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    names = [entry.name for entry in (*LAYOUT, *LEARNT)]
    writer.writerow(["episode", *READINGS, *names, "decision"])
    readings = readings_of(states.flat)
    periods = states.actions.shape[1]
    for k, (row, action) in enumerate(zip(inputs, states.actions.ravel(), strict=True)):
        numbers = [*(readings[name][k] for name in READINGS), *row]
        written = (f"{number:.9g}" for number in numbers)  # nine digits give a float back to the bit
        writer.writerow([k // periods, *written, action])
    return stream.getvalue()


def as_text(report: dict[str, Any], contract: dict[str, Any]) -> str:
    """The report of an export, for people."""
    a, loop = report["agreement"], report["closed_loop"]
    operations, size = contract["operations"], contract["bytes"]
    return "\n".join(
        [
            f"agreement on {a['states']} visited states: {a['agrees']}",
            f"rounding of the logits: {a['rounding_of_c']:.2g} in C, {a['rounding_of_python']:.2g} in "
            "Python",
            f"{operations['multiply_accumulates']} multiply-accumulates, {size['constants']} B of "
            f"constants, {size['memory_of_a_valve']} B of memory for each valve",
            f"in closed loop, {loop['episodes']} episodes of {loop['duration_s']:g} s:",
            *(
                f"  {name}: stayed {row['C1_stayed']:.1%}, worst {row['C1_worst_excursion_bar']:.3f}, "
                f"rms {row['rms_error_bar']:.4f} bar, {row['switchings_per_s']:.2f} switchings/s"
                for name, row in loop["controllers"].items()
            ),
        ]
    )
