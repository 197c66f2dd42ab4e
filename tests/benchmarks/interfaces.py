"""The interfaces at which control periods are counted, from the kernel to the learning, each a workload.

    python -P tests/benchmarks/interfaces.py

reads names of INTERFACES line by line and answers each with the rate of one run, as JSON. So another
process can measure two commits by turns (tests/benchmarks/paired.py): this file uses nothing of the
project that earlier commits lack.
"""

import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import gymnasium
import numpy as np
from numpy.typing import NDArray

import epv_env  # noqa: F401 - registers the ids

IDENTIFIER = "EPValve-v0"
SWITCHING = 0.15
"""Probability that a valve is switched at a decision."""

Run = Callable[[], int]
"""Runs a workload once and returns the control periods that it simulated."""


@dataclass(frozen=True, kw_only=True)
class Interface:
    """One place at which control periods are counted."""

    name: str
    """Name in tables."""
    begin: Callable[[float], Run]
    """Makes the workload; its argument is a share of the usual length [1]."""
    kernel: str | None = None
    """Name of the interface with the kernel's rate for as many valves and threads."""
    one_thread: bool = False
    """Whether it runs in one thread: its CPU time is counted, which other processes hardly disturb."""


def actions(n: int, periods: int) -> NDArray:
    """Coils that are switched at random, (periods, n)."""
    switched = np.random.default_rng(0).random((periods, n)) < SWITCHING
    return (1 - np.cumsum(switched, axis=0) % 2).astype(np.int64)


def _kernel(n: int, threads: int, share: float) -> Run:
    """Many periods in one call of the kernel."""
    from tests.benchmarks import workloads

    periods = max(round(share * 150_000 / (n + 500)), 1)
    valves = workloads.energised_valves(n, threads)
    inputs = workloads.random_switching(n, periods)

    def run() -> int:
        valves.record(inputs, workloads.PERIOD)
        return n * periods

    return run


def _vector(n: int, threads: int, share: float) -> Run:
    """The vector environment, one call a period."""
    env = gymnasium.make_vec(IDENTIFIER, num_envs=n, threads=threads)
    env.reset(seed=0)
    commands = actions(n, max(round(share * 150_000 / (n + 500)), 1))

    def run() -> int:
        for command in commands:
            env.step(command)
        return commands.size

    return run


def _single(share: float, **options: bool) -> Run:
    """One environment, its reset included."""
    env = gymnasium.make(IDENTIFIER, **options)  # type: ignore[arg-type]
    commands = actions(1, max(round(share * 1900), 1))[:, 0].tolist()

    def run() -> int:
        env.reset(seed=0)
        for command in commands:
            env.step(command)
        return len(commands)

    return run


def _adapted(n: int, share: float) -> Run:
    """stable-baselines3's vector environment, actions given."""
    from epv_env.sb3 import make_sb3_env

    env = make_sb3_env(IDENTIFIER, n)
    env.reset()
    commands = actions(n, max(round(share * 150_000 / (n + 500)), 1))

    def run() -> int:
        for command in commands:
            env.step(command)
        return commands.size

    return run


@cache
def _model():
    """PPO with the default hyperparameters on drawn plants, as `make train` has it."""
    import torch

    from epv_env.plant.plantfile import load_plant
    from epv_env.reward import RewardWeights
    from training.learners.hyperparameters import Hyperparameters
    from training.learners.ppo import make_model
    from training.learners.training_env import make_training_env

    torch.set_num_threads(1)
    h = Hyperparameters()
    env = make_training_env(
        h, plant=load_plant(None), scenario="mixed", parameters="confidence", seed=0,
        weights=RewardWeights(),
    )  # fmt: skip
    return make_model(h, env, seed=0, device="cpu")


def _collecting(share: float) -> Run:
    """One rollout of PPO: environment, policy and buffer."""
    model = _model()
    _, callback = model._setup_learn(1, callback=None)
    steps = max(round(share * model.n_steps), 1)
    env = model.env
    assert env is not None

    def run() -> int:
        model.collect_rollouts(env, callback, model.rollout_buffer, n_rollout_steps=steps)
        return steps * model.n_envs

    return run


def _learning(share: float) -> Run:
    """One rollout and the update that follows it."""
    model = _model()
    periods = model.n_steps * model.n_envs

    def run() -> int:
        model.learn(periods, reset_num_timesteps=False)
        return periods

    return run


def _batches() -> list[Interface]:
    found = []
    for n in (256, 1024):
        for threads in (1, 2):
            what = f"{n} valves, {threads} thread{'s' * (threads > 1)}"
            kernel = f"kernel, {what}"
            found += [
                Interface(name=kernel, begin=partial(_kernel, n, threads), one_thread=threads == 1),
                Interface(
                    name=f"vector environment, {what}",
                    begin=partial(_vector, n, threads),
                    kernel=kernel,
                    one_thread=threads == 1,
                ),
            ]
    return found


_ONE_VALVE = "kernel, 1 valve, 1 thread"

INTERFACES = {
    interface.name: interface
    for interface in (
        *_batches(),
        Interface(name=_ONE_VALVE, begin=partial(_kernel, 1, 1), one_thread=True),
        Interface(name="single environment", begin=_single, kernel=_ONE_VALVE, one_thread=True),
        Interface(
            name="single environment, disable_env_checker=True",
            begin=partial(_single, disable_env_checker=True),
            kernel=_ONE_VALVE,
            one_thread=True,
        ),
        Interface(name="stable-baselines3 VecEnv, 256 valves", begin=partial(_adapted, 256)),
        Interface(name="PPO as in make train, collecting", begin=_collecting),
        Interface(name="PPO as in make train, learning included", begin=_learning),
    )
}
"""All interfaces by name; threads are those of the plant, PyTorch has one."""


def rate(name: str, run: Run) -> float:
    """Control periods per second in one run of an interface: of CPU time if it has one thread."""
    clock = time.process_time if INTERFACES[name].one_thread else time.perf_counter
    start = clock()
    periods = run()
    return periods / (clock() - start)


def main() -> None:
    """Answer names on the standard input with rates, or with what this commit lacks."""
    runs: dict[str, Run] = {}
    for line in sys.stdin:
        name, share = json.loads(line)
        try:
            if name not in runs:
                runs[name] = INTERFACES[name].begin(share)
                runs[name]()  # compiles and warms up
            answer = {"rate": rate(name, runs[name])}
        except (ImportError, AttributeError, TypeError) as error:
            answer = {"lacks": str(error)}
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
