"""Check what runs on an accelerator against the CPU, then time it.

    python -m docs.studies.device.study [--only checks episodes ...]

Each part writes its figures to figures.json, and its table to README.md, as it ends. Nothing is timed
after checks that disagree. Without an accelerator numba's simulator shows that the script works; its
times mean nothing:

    NUMBA_ENABLE_CUDASIM=1 NUMBA_DISABLE_JIT=1 python -m docs.studies.device.study --quick
"""

import json
import os
import pickle
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from copy import deepcopy
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import gymnasium
import numpy as np
from numba import cuda
from numpy.typing import NDArray

import epv_env  # noqa: F401 - registers the ids
from controllers.policy import load_policy
from controllers.tuned import tuned
from docs.studies.common import PAGE, fill, study_options, study_parser, table
from epv_env.common.files import write_text
from epv_env.device.kernels import P2, Batch
from epv_env.device.vector_env import SIMULATED
from tests.benchmarks.relief_device import run_device
from tests.benchmarks.relief_peers import run_scipy
from tests.benchmarks.relief_valve import Task, flows
from training.evaluation import rollout
from training.evaluation.on_device import run_begun
from training.evaluation.rollout import NEVER, begin_episodes, make_env

FOLDER = Path(__file__).parent
WITHIN_MBAR = 1e-6
"""Greatest difference of p2 from the CPU."""
PERIOD, SEED = 5e-3, 7
CONDITIONS = {"conditions": "broad", "sensor_noise": 0.0}
LOOPS = {"random switching": False, "closed loop": True}
SIMULATOR = ("NUMBA_ENABLE_CUDASIM", "NUMBA_DISABLE_JIT")
"""Settings of the simulator in a process's environment."""
SWEEP = (
    "epv sweep --designs regions --controllers PPO 'extrapolating hysteresis' --joint-episodes 131072 "
    "--device cuda --out "
)
"""A million episodes of 10 s: four regions under two controllers."""


def controllers() -> dict[str, Any]:
    """Those of the comparison that decide in a compiled function."""
    names = ("extrapolating hysteresis", "hysteresis", "adaptive pulse")
    return {"PPO": load_policy(), **{name: tuned(name) for name in names}}


def p2(n: int, periods: int, closed: bool, device: str) -> NDArray:
    """p2 of an environment, switched at random or by a hysteresis, (periods, n) [Pa]."""
    limit = {"max_episode_steps": periods + 1}
    envs: Any = gymnasium.make_vec("EPValve-v0", num_envs=n, device=device, **limit, **CONDITIONS)
    seen, rng, found = envs.reset(seed=SEED)[0], np.random.default_rng(0), []
    on = np.ones(n, dtype=bool)
    for _ in range(periods):
        on ^= rng.random(n) < 0.15
        host = seen if device == "cpu" else seen.copy_to_host()
        seen = envs.step(((host[:, 0] > 0.0) if closed else on).astype(np.int64))[0]
        cpu = device == "cpu"
        found.append(envs.task.valves.state.p2.copy() if cpu else envs._batch.numbers[P2].copy_to_host())
    return np.array(found)


def on_cpu(
    controller: Any, seeds: Sequence[int], periods: int, restart: int = NEVER, **options: Any
) -> tuple[NDArray, NDArray, dict[str, Any]]:
    """Episodes under a controller: decisions and p2 [Pa], (periods, 2, n), what is counted, and the
    arguments of `on_device.run_begun` for the same episodes."""
    env: Any = make_env(controller, len(seeds), **options)
    seen, task = begin_episodes(env, controller, seeds), env.task
    arguments = {
        "controller": controller, "settings": env.settings, "begun": deepcopy(Batch.of(task)),
        "noise": task._noise.copy(),
    }  # fmt: skip
    record = np.empty((periods, 2, len(seeds)))
    counted = rollout.run_begun(env, controller, seen, periods=periods, restart=restart, record=record)
    return record, counted, arguments


def on_host(n: int, periods: int) -> dict[str, Any]:
    """What the CPU gives, by case."""
    seeds = range(SEED, SEED + n)
    return {loop: p2(n, periods, closed, "cpu") for loop, closed in LOOPS.items()} | {
        name: on_cpu(each, seeds, periods, **CONDITIONS) for name, each in controllers().items()
    }


def from_host(n: int, periods: int) -> dict[str, Any]:
    """`on_host` in a process of its own: in the simulator's, nothing is compiled."""
    code = "import pickle, sys; from docs.studies.device import study; "
    code += f"pickle.dump(study.on_host({n}, {periods}), open(sys.argv[1], 'wb'))"
    environment = {k: v for k, v in os.environ.items() if k not in SIMULATOR}
    with TemporaryDirectory() as folder:
        file = Path(folder, "cases")
        subprocess.run([sys.executable, "-c", code, file], env=environment, check=True)
        return pickle.loads(file.read_bytes())


def checks(quick: bool) -> list[list[Any]]:
    """By case: greatest difference of p2 from the CPU's [mbar], and number of other decisions.

    Raises SystemExit if the device disagrees.
    """
    n, periods = (3, 12) if quick else (256, 400)
    rows = []
    for case, expected in from_host(n, periods).items():
        if case in LOOPS:
            others, difference = 0, np.abs(p2(n, periods, LOOPS[case], "cuda") - expected)
        else:
            record = np.zeros_like(expected[0])
            arguments = expected[2] | {"noise": np.zeros((n, periods + 1, 4))}
            run_begun(**arguments, periods=periods, record=record)
            decisions, difference = np.abs(record - expected[0]).transpose(1, 0, 2)
            others = int(decisions.sum())
        rows.append([case, float(difference.max() / 100), others])
    if worst := [row for row in rows if not row[1] <= WITHIN_MBAR or row[2]]:
        raise SystemExit(f"the device disagrees with the CPU, nothing is timed: {worst}")
    return rows


def network() -> Callable[[Any], Any]:
    """A user's own policy: from observations to actions on the device, by 64 x 64 neurons of torch."""
    import torch

    layers: list[Any] = [torch.nn.LazyLinear(64), torch.nn.Tanh(), torch.nn.Linear(64, 64)]
    net = torch.nn.Sequential(*layers, torch.nn.Tanh(), torch.nn.Linear(64, 2)).cuda()
    return torch.no_grad()(lambda seen: net(torch.as_tensor(seen, device="cuda")).argmax(dim=1))


def seconds(work: Callable[[], Any]) -> float:
    """Time until the device has done it."""
    cuda.synchronize()
    begin = time.perf_counter()
    work()
    cuda.synchronize()
    return time.perf_counter() - begin


def steps(quick: bool) -> list[list[Any]]:
    """A launch a period: time of a step [ms], and simulated seconds a second."""
    sizes, periods = ((2,), 2) if quick else ((1, 4096, 65_536, 262_144), 200)
    rows = []
    for n in sizes:
        envs = gymnasium.make_vec("EPValve-v0", num_envs=n, device="cuda", max_episode_steps=2000)
        ones = cuda.to_device(np.ones(n, dtype=np.int64))
        acts = {"constant": lambda seen, ones=ones: ones} | ({} if SIMULATED else {"torch": network()})
        for name, act in acts.items():
            seen = [envs.reset(seed=SEED)[0]]

            def run(count: int, act: Any = act, envs: Any = envs, seen: Any = seen) -> None:
                for _ in range(count):
                    seen[0] = envs.step(act(seen[0]))[0]

            run(1)  # compiles
            step = seconds(lambda run=run: run(periods)) / periods
            rows.append([n, name, 1e3 * step, n * PERIOD / step])
    return rows


def episodes(quick: bool) -> list[list[Any]]:
    """A launch for whole episodes: simulated seconds a second."""
    sizes, periods, few = ((2,), 2, 2) if quick else ((4096, 65_536, 262_144), 400, 4096)
    cases, rows = from_host(few, 1), []
    for name in ("PPO", "extrapolating hysteresis"):
        work = {k: v for k, v in cases[name][2].items() if k in ("controller", "settings")}
        for n in sizes:
            begun = Batch(*(np.tile(each, n // few) for each in cases[name][2]["begun"]))
            run_begun(**work, begun=begun, periods=0)  # compiles
            base, whole = (
                seconds(lambda k=k, b=begun, work=work: run_begun(**work, begun=b, periods=k))
                for k in (0, periods)
            )
            rows.append([name, n, n * periods * PERIOD / (whole - base)])
    return rows


def sweep(quick: bool) -> list[list[Any]]:
    """Time of a command of a million episodes, from its start to its tables [s]."""
    if quick:
        return []
    with TemporaryDirectory() as folder:
        command = f"{sys.executable} -m training.{SWEEP}{folder}/out"
        command += f" > {os.devnull}"  # its next command is about this folder
        return [[SWEEP, seconds(lambda: subprocess.run(command, shell=True, check=True))]]


def relief(quick: bool) -> list[list[Any]]:
    """The relief valve of arXiv 2011.01740, by step: maxima of the lift a second, and their error.

    The error is that of the first ones, before chaos has enlarged any difference.
    """
    first, many = Task(flows=flows(8), transient=4, recorded=8), Task(flows=flows(30_720))
    true, rows = run_scipy(first, "DOP853", 1e-12)[0], []
    for step in (2e-2, 5e-3):
        error = run_device(first, step)[0].error(true)  # compiles
        found, took = run_device(first if quick else many, step)
        rows.append([step, float(found.passed.sum() / took), error])
    return rows


PARTS: dict[str, tuple[Callable[[bool], list[list[Any]]], list[str]]] = {
    "checks": (checks, ["case", "greatest difference of p2 [mbar]", "other decisions"]),
    "steps": (steps, ["valves", "actions", "step [ms]", "simulated seconds a second"]),
    "episodes": (episodes, ["controller", "episodes", "simulated seconds a second"]),
    "sweep": (sweep, ["command", "time [s]"]),
    "relief": (relief, ["step", "maxima a second", "error"]),
}
"""What finds the rows of a table, and its headings, in the order in which they run."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the parts."""
    parser = study_parser(__doc__ or "", FOLDER)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS), help="these parts")
    options = study_options(parser, arguments)
    if not cuda.is_available():
        raise SystemExit(
            "no accelerator here: run it on one, or in the simulator (see the file's docstring)"
        )
    device = "simulator" if SIMULATED else cuda.get_current_device().name
    path = options.out / "figures.json"
    known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    for name in options.only:
        find, headings = PARTS[name]
        known |= {"device": str(device), name: find(options.quick)}
        write_text(path, json.dumps(known, indent=1) + "\n")
        rows = [[f"{x:,.4g}" if isinstance(x, float) else str(x) for x in row] for row in known[name]]
        fill(options.out / PAGE, {"device": f"Measured on: {device}.", name: table(headings, rows)})
    return 0


if __name__ == "__main__":
    sys.exit(main())
