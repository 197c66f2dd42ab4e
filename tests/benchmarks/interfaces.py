"""The workloads of `make bench`: each interface, from the kernel to the learning, counts its periods."""

import json
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import gymnasium
import numpy as np
from numpy.typing import NDArray

import epv_env  # noqa: F401 - registers the ids
from epv_env.plant.equations import Inputs
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves

IDENTIFIER = "EPValve-v0"
PERIOD = 5e-3
"""Time between decisions [s]."""
SWITCHING = 0.15
"""Probability that a valve is switched at a decision."""
P1, P2, U_ON = 12.0e5, 7.0e5, 24.0
"""Supply and circuit pressure at the start [Pa], voltage of the energised coil [V]."""

Run = Callable[[], int]
"""Runs a workload once and returns the control periods that it simulated."""


@dataclass(frozen=True, kw_only=True)
class Interface:
    """One place at which control periods are counted."""

    begin: Callable[[float], Run]
    """Makes the workload; its argument is a share of the usual length [1]."""
    kernel: str | None = None
    """Name of the interface with the kernel's rate for as many valves."""


def actions(n: int, share: float) -> NDArray:
    """Coils that are switched at random, (periods, n); fewer periods for more valves."""
    periods = max(round(share * 150_000 / (n + 500)), 1)
    switched = np.random.default_rng(0).random((periods, n)) < SWITCHING
    return (1 - np.cumsum(switched, axis=0) % 2).astype(np.int64)


def _kernel(n: int, share: float) -> Run:
    """Many periods in one call of the kernel."""
    p = Parameters.calibrated()
    valves = Valves.started(n, p, energised(p, p1=P1, p2=P2, U=U_ON), threads=1)
    on = actions(n, share)
    zeros = np.zeros(on.shape)
    flow = np.random.default_rng(1).uniform(0, 4e-3, (1, n)) + zeros
    inputs = Inputs(U_ON * on, flow, *[zeros] * 5)

    def run() -> int:
        valves.record(inputs, PERIOD)
        return on.size

    return run


def _vector(n: int, share: float) -> Run:
    """The vector environment, one call a period."""
    env = gymnasium.make_vec(IDENTIFIER, num_envs=n, threads=1)
    env.reset(seed=0)
    return partial(_stepped, env, actions(n, share))


def _single(share: float) -> Run:
    """One environment, its reset included."""
    env = gymnasium.make(IDENTIFIER)
    commands = actions(1, max(share, 1.0))[:, 0].tolist()  # long, beside the reset

    def run() -> int:
        env.reset(seed=0)
        return _stepped(env, commands)

    return run


def _stepped(env: gymnasium.Env | gymnasium.vector.VectorEnv, commands) -> int:
    """The control periods of an environment that is stepped through commands."""
    for command in commands:
        env.step(command)
    return np.size(commands)


def _learning(share: float) -> Run:
    """Rollouts and updates of stable-baselines3's own PPO with 256 valves."""
    import torch
    from stable_baselines3 import PPO

    from epv_env.sb3 import make_sb3_env

    torch.set_num_threads(1)
    env = make_sb3_env(IDENTIFIER, 256)
    model = PPO("MlpPolicy", env, n_steps=16 * max(round(8 * share), 1), batch_size=512, device="cpu")

    def run() -> int:
        before = model.num_timesteps
        model.learn(model.n_steps * 256, reset_num_timesteps=False)
        return model.num_timesteps - before

    return run


INTERFACES = {
    "kernel, 1 valve": Interface(begin=partial(_kernel, 1)),
    "kernel, 256 valves": Interface(begin=partial(_kernel, 256)),
    "kernel, 1024 valves": Interface(begin=partial(_kernel, 1024)),
    "single environment": Interface(begin=_single, kernel="kernel, 1 valve"),
    "vector environment, 256 valves": Interface(
        begin=partial(_vector, 256), kernel="kernel, 256 valves"
    ),
    "vector environment, 1024 valves": Interface(
        begin=partial(_vector, 1024), kernel="kernel, 1024 valves"
    ),
    "stable-baselines3's PPO, 256 valves, learning included": Interface(begin=_learning),
}
"""All interfaces by name; plant and PyTorch have one thread."""


def rate(name: str, run: Run) -> float:
    """Control periods per CPU second in one run of an interface."""
    start = time.process_time()
    periods = run()
    return periods / (time.process_time() - start)


def one_valve(duration: float) -> dict[str, Callable[[], tuple[float, float]]]:
    """Simulators of one valve, by name: each gives seconds per CPU second and p2's error [Pa]."""
    from tests.reference.hybrid_automaton import piecewise_schedule
    from tests.reference.reference_simulation import simulate_reference
    from tests.reference.schedule import plant_states

    p = Parameters.calibrated()
    times = np.arange(round(duration / PERIOD) + 1) * PERIOD
    on = np.cumsum(np.random.default_rng(0).random(len(times) - 1) < SWITCHING) % 2 == 0
    schedule = piecewise_schedule(
        p, energised(p, p1=P1, p2=P2, U=U_ON), times, U=U_ON * on, sigma_S=np.full(len(on), 2e-3)
    )
    end = [schedule.duration]
    true = simulate_reference(schedule, end, rtol=1e-11).state.p2[0]

    def timed(simulated: Callable[[], float]) -> tuple[float, float]:
        start = time.process_time()
        p2 = simulated()
        return duration / (time.process_time() - start), abs(p2 - true)

    return {
        "this plant, a batch of one": lambda: timed(lambda: plant_states(schedule, end).p2[0]),
        "SciPy LSODA with events, compiled right-hand side, 1e-6": lambda: timed(
            lambda: simulate_reference(schedule, end, rtol=1e-6).state.p2[0]
        ),
    }


STARTUP = {
    "import epv_env": "import epv_env",
    "import, one valve, first 5 ms simulated": (
        "from epv_env.plant.valves import Valves; Valves(1).advance(5e-3)"
    ),
}
"""What is timed in a new interpreter, without the interpreter's own start."""


def startup_seconds(repetitions: int) -> dict[str, list[float]]:
    """Times of STARTUP [s]; one process before them fills the caches and is not counted."""
    found = {}
    for name, code in STARTUP.items():
        timed = f"import time; start = time.perf_counter(); {code}; print(time.perf_counter() - start)"
        command = [sys.executable, "-c", timed]
        printed = [subprocess.check_output(command, text=True) for _ in range(repetitions + 1)]
        found[name] = [float(text) for text in printed[1:]]
    return found


LAUNCHER = """
import json, resource, subprocess, sys, time
start = time.perf_counter()
subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
seconds = time.perf_counter() - start
print(json.dumps([seconds, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024]))
"""
"""Starts a command. A process inherits the peak memory of its parent, so the parent is small."""


def used_by(arguments: tuple[str, ...], folder: Path) -> tuple[float, float]:
    """Wall time [s] and peak memory [MiB] of `python -m identification ARGUMENTS` run in a folder."""
    command = [sys.executable, "-m", "identification", *arguments]
    printed = subprocess.check_output([sys.executable, "-c", LAUNCHER, *command], cwd=folder, text=True)
    seconds, peak = json.loads(printed)
    return seconds, peak
