"""Whether compiled code decides as the policy: along visited states, and in closed loop."""

import csv
import ctypes
import io
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.base import Controller
from controllers.learned import LearnedPolicy
from epv_env.observation import LAYOUT
from training.deploy.c_code import ExportError
from training.deploy.compiled import READINGS, CompiledPolicy, logits_of, readings_of
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


def margins(policy: LearnedPolicy, states: VisitedStates, dtype: type = np.float64) -> NDArray:
    """Logit of on minus logit of off (states,), computed by Python in this precision."""
    layers = [(weight.astype(dtype), bias.astype(dtype)) for weight, bias in policy.layers]
    return _difference(replace(policy, layers=layers).logits(states.flat))


def _difference(logits: NDArray) -> NDArray:
    """Logit of on minus that of off (...) in double precision, from logits (..., 2)."""
    return logits[..., 1].astype(np.float64) - logits[..., 0]


def agreement(policy: LearnedPolicy, code: ctypes.CDLL, states: VisitedStates) -> dict[str, Any]:
    """How the code's decisions compare with the policy's, and how near any of them was to a tie.

    Raises ExportError if they differ on any state.
    """
    logits = logits_of(code, states.flat)
    differs = (logits[:, 0] < logits[:, 1]) != states.actions.ravel()
    exact = margins(policy, states)
    if np.any(differs):
        worst = np.abs(exact[differs]).max()
        raise ExportError(
            f"the C code decides otherwise than the policy on {differs.sum()} of {exact.size} states, "
            f"where the logits are up to {worst:.2g} apart: below 1e-4 that is rounding at a tie, train "
            "a little longer; above it the code is wrong"
        )
    return {
        "states": exact.size,
        "agrees": int(np.sum(~differs)),
        "least_margin": float(np.abs(exact).min()),
        "rounding_of_c": float(np.abs(_difference(logits) - exact).max()),
        "rounding_of_python": float(np.abs(margins(policy, states, np.float32) - exact).max()),
    }


def closed_loop(
    policy: LearnedPolicy, code: ctypes.CDLL, *, episodes: int, duration: float
) -> dict[str, dict[str, float]]:
    """FIGURES of the policy and of its compiled code on the same episodes, by controller's name."""
    figures = {}
    seeds = list(range(CLOSED_LOOP_SEED, CLOSED_LOOP_SEED + episodes))
    for controller in (policy, CompiledPolicy(code=code)):
        metrics, _ = run_episodes(controller, seeds=seeds, duration=duration, options=OPTIONS)
        found = summary(metrics)
        figures[controller.name] = {name: found[name] for name in FIGURES}
    return figures


def states_table(states: VisitedStates, exact: NDArray) -> str:
    """states.csv: episode, readings, observation, the policy's decision, and its margin (states,)."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    names = [entry.name for entry in LAYOUT]
    writer.writerow(["episode", *READINGS, *names, "policy_action", "policy_margin"])
    readings = readings_of(states.flat)
    periods = states.actions.shape[1]
    for k, (observation, action) in enumerate(zip(states.flat, states.actions.ravel(), strict=True)):
        numbers = [*(readings[name][k] for name in READINGS), *observation]
        written = (f"{number:.9g}" for number in numbers)  # nine digits give a float back to the bit
        writer.writerow([k // periods, *written, action, f"{exact[k]:.9g}"])
    return stream.getvalue()


def as_text(report: dict[str, Any], contract: dict[str, Any]) -> str:
    """The report of an export, for people."""
    a, time, loop = report["agreement"], report["microseconds"], report["closed_loop"]
    operations, size = contract["operations"], contract["bytes"]
    return "\n".join(
        [
            f"agreement on {a['states']} visited states: {a['agrees']}",
            f"nearest to a tie: logits {a['least_margin']:.2g} apart; rounding moves that by "
            f"{a['rounding_of_c']:.2g} in C, {a['rounding_of_python']:.2g} in Python",
            f"a decision: median {time['median_us']:.2f} us, slowest state "
            f"{time['slowest_state_us']:.2f} us, slowest call {time['slowest_call_us']:.1f} us",
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
