"""Running controllers on scenarios: the same seeds give every controller the same episodes."""

import gc
import time
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

import epv_env  # noqa: F401 - registers the ids
from controllers.base import Controller, Privileged
from epv_env.vector_env import EPValvePWMVectorEnv, EPValveVectorEnv
from training.evaluation.metrics import METER, EpisodeMetrics, count_all
from training.evaluation.seeds import TIMING_SEED
from training.evaluation.sensor_faults import Fault, SensorFaults

NEVER, NOTHING = -1, np.empty((0, 0, 0))
"""Instead of a period before which the control unit restarts, and of arrays."""
WARM_UP_DECISIONS = 50
"""Decisions whose time is not counted."""


def make_env(controller: Controller, n: int, **options: Any) -> EPValveVectorEnv | EPValvePWMVectorEnv:
    """The controller's environment, n valves, without autoreset or time limit."""
    return gymnasium.make_vec(
        controller.environment,
        num_envs=n,
        vectorization_mode="vector_entry_point",
        autoreset_mode="Disabled",
        max_episode_steps=None,
        **options,
    )  # type: ignore[return-value]


def begin_episodes(
    env: EPValveVectorEnv | EPValvePWMVectorEnv,
    controller: Controller,
    seeds: Sequence[int],
    options: dict[str, Any] | None = None,
) -> NDArray:
    """Start an episode for each seed under the controller; returns the first observations (n, entries).

    A privileged controller gets to see the task.

    Args:
        env: of n valves.
        controller: is reset.
        seeds: n of them.
        options: of the reset.
    """
    observation, _ = env.reset(seed=list(seeds), options=options)
    controller.reset(len(seeds))
    if isinstance(controller, Privileged):
        own: Any = env.unwrapped
        controller.watch(own.task)
    return observation


def run_begun(
    env: EPValveVectorEnv | EPValvePWMVectorEnv,
    controller: Controller,
    observation: NDArray,
    *,
    periods: int,
    restart: int = NEVER,
    record: NDArray = NOTHING,
    faults: SensorFaults | None = None,
) -> NDArray:
    """Run episodes that have begun with an observation (n, entries); returns records of METER (n,).

    An episode whose circuit empties violates the constraint (C1) and ends there: the failure is charged
    once and nothing later counts. Its valve runs on unseen, since the batch runs as one.

    restart: period before which the control unit restarts, so that the controller forgets everything; a
    privileged one remembers. record: filled with actions and p2 [Pa], (periods, 2, n). faults: of the
    sensors that the controller reads.
    """
    own: Any = env.unwrapped
    settings, meters = own.settings, np.zeros(len(observation), METER)
    for k in range(periods):
        if k == restart and not isinstance(controller, Privileged):
            controller.reset(len(meters))
        if faults is not None:
            observation = faults.shown(observation)
        actions = controller.act(observation)
        result = env.advance(actions)
        observation = result.observation
        count_all(
            meters, result.figures, env.coil_energy, settings.control_period, settings.settling_time
        )
        if len(record):
            record[k] = actions, own.task.valves.state.p2
    return meters


def run_episodes(
    controller: Controller,
    *,
    seeds: Sequence[int],
    duration: float,
    options: dict[str, Any],
    restart_s: float | None = None,
    faults: Sequence[Fault] = (),
) -> EpisodeMetrics:
    """Run one episode per seed, as `run_begun` does; returns their metrics.

    Args:
        controller: decides for all episodes.
        seeds: of the episodes.
        duration: of each episode [s].
        options: of the environment.
        restart_s: when the control unit restarts, and the plant goes on [s]; None: never.
        faults: of the sensors that the controller reads, from BEGINS_S on.
    """
    env = make_env(controller, len(seeds), **options)
    observation, period = begin_episodes(env, controller, seeds), env.settings.control_period
    restart = NEVER if restart_s is None else round(restart_s / period)
    periods = round(duration / period)
    rng = np.random.default_rng(seeds[0])
    failing = SensorFaults(faults, len(seeds), period, rng) if faults else None
    meters = run_begun(env, controller, observation, periods=periods, restart=restart, faults=failing)
    return EpisodeMetrics.of(meters, period)


def decision_times(
    controller: Controller, decisions: int, *, seed: int = TIMING_SEED, **options: Any
) -> NDArray:
    """Processor time of each decision of one valve's episode [s] (decisions,).

    Times are those of this implementation on this machine, without garbage collection: a control unit
    has no garbage. The first decisions compile and fill caches and are not counted.

    Args:
        controller: whose `act` is timed.
        decisions: how many.
        seed: of the episode.
        options: of the environment.
    """
    env = make_env(controller, 1, threads=1, **options)
    observation = begin_episodes(env, controller, [seed])
    seconds = np.zeros(WARM_UP_DECISIONS + decisions)
    collects = gc.isenabled()
    gc.disable()
    try:
        for k in range(len(seconds)):
            begin = time.process_time()
            action = controller.act(observation)
            seconds[k] = time.process_time() - begin
            observation = env.advance(action).observation
    finally:
        if collects:
            gc.enable()
    return seconds[WARM_UP_DECISIONS:]
