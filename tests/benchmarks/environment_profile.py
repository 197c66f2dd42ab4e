"""Where a step of the environment spends its time: its parts, called and timed one after another."""

import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

from epv_env.period import step_conclude, step_prepare
from epv_env.plant.integrate import run_nominal
from epv_env.result import StepResult, step_info
from tests.benchmarks.interfaces import IDENTIFIER, actions
from tests.benchmarks.measure import Table

PARTS = {
    "decode": "actions to the coil's times",
    "prepare": "switchings, consumption, supply, inputs",
    "kernel": "the plant",
    "conclude": "reward, sensors, history, observation",
    "infos": "names for the figures",
    "noise": "drawn once in 256 steps, its share of one",
    "step": "the whole step; its rest is Python and memory",
}
"""Parts of a step, and what they do."""
PERIODS = 200
"""Steps that are timed."""


class _Watch:
    """CPU times of what was called, by part [us]."""

    def __init__(self) -> None:
        self.times: dict[str, list[float]] = {part: [] for part in PARTS}

    def __call__(self, part: str, function: Callable[..., Any], *arguments: Any) -> Any:
        start = time.thread_time()
        found = function(*arguments)
        self.times[part].append(1e6 * (time.thread_time() - start))
        return found


def profile(table: Table, repetitions: int) -> None:
    """Median time of each part for 256 and 1024 valves on one thread, and its share of the step."""
    for n in (256, 1024):
        table.section(f"parts of a step of {n} valves on one thread; ratio: to the step")
        watch = _Watch()
        for _ in range(repetitions):
            _timed_steps(watch, n)
        whole = float(np.median(watch.times["step"]))
        for part, times in watch.times.items():
            table.add(part, "us", times, ratio=float(np.median(times)) / whole, note=PARTS[part])


def _timed_steps(watch: _Watch, n: int) -> None:
    """Steps whose parts are called one by one, and as many whole steps."""
    env: Any = gymnasium.make_vec(IDENTIFIER, num_envs=n, threads=1)
    env.reset(seed=0)
    task, tables, commands = env.task, env.task.valves.tables, actions(n, PERIODS)
    lanes = tables.state.shape[1]
    record = np.empty((0, *tables.state.shape))
    observation, figures = task.step(*env.action.decode(commands[0]))
    for command in commands:
        decoded = watch("decode", env.action.decode, command)
        arguments = (*task._fixed, *decoded, figures, observation, 0, lanes)
        watch("prepare", step_prepare, *arguments)
        watch("kernel", run_nominal, *tables[:3], task._inputs[:1], task._duration[:1], *tables[3:5],
              record, task.valves.step, 0, lanes)  # fmt: skip
        watch("conclude", step_conclude, *arguments)
        watch("infos", step_info, StepResult(observation, figures))
    watch("noise", task._draw_noise, np.arange(n))
    watch.times["noise"][-1] /= task._noise.shape[1]
    env.reset(seed=0)
    for command in commands:
        watch("step", env.step, command)
