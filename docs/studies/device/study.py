"""Check the environments on an accelerator against the CPU, then time them.

    python -m docs.studies.device.study

writes figures.json and the tables of README.md. Nothing is timed before it has agreed with the CPU.
Without an accelerator numba's simulator shows that the script works; its times mean nothing:

    NUMBA_ENABLE_CUDASIM=1 NUMBA_DISABLE_JIT=1 python -m docs.studies.device.study --quick
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import gymnasium
import numpy as np
from numba import cuda

import epv_env  # noqa: F401 - registers the ids
from docs.studies.common import PAGE, fill, study_options, study_parser, table
from epv_env.common.files import write_text
from epv_env.device.vector_env import SIMULATED

FOLDER = Path(__file__).parent
WITHIN_MBAR = 1e-6
"""Greatest difference of p2 from the CPU."""
PERIOD = 5e-3
CONDITIONS = ("ordinary", "broad")
SIMULATOR = ("NUMBA_ENABLE_CUDASIM", "NUMBA_DISABLE_JIT")
"""Settings of the simulator in a process's environment."""
COMMANDS = ("sweep.py --designs regions --joint-episodes 65536",)
"""Commands of training/ that are timed as a whole, with --device cuda."""


def made(n: int, conditions: str, device: str, **options: Any) -> Any:
    """Environments of n valves, and their reset with a fixed seed."""
    envs = gymnasium.make_vec("EPValve-v0", num_envs=n, device=device, conditions=conditions, **options)
    return envs, envs.reset(seed=7)[0]


def hysteresis(observation: np.ndarray) -> np.ndarray:
    """Actions of a controller that switches at the target, (n,)."""
    return (observation[:, 0] > 0.0).astype(np.int64)


def p2(n: int, periods: int, conditions: str, closed: bool, device: str, **options: Any) -> np.ndarray:
    """p2 under random switching or in a closed loop, without noise, (periods, n) [Pa]."""
    fixed = {"sensor_noise": 0.0, "max_episode_steps": periods + 1, **options}
    envs, observation = made(n, conditions, device, **fixed)
    rng, found = np.random.default_rng(0), []
    on = np.ones(n, dtype=bool)
    for _ in range(periods):
        on ^= rng.random(n) < 0.15
        host = observation if device == "cpu" else observation.copy_to_host()
        observation = envs.step(hysteresis(host) if closed else on.astype(np.int64))[0]
        state = envs.task.valves.tables.state if device == "cpu" else envs._batch.state.copy_to_host()
        found.append(state[0, :n].copy())
    return np.array(found)


def p2_of_cpu(n: int, *case: Any) -> np.ndarray:
    """`p2` on the CPU, in a process of its own: in the simulator's, nothing is compiled."""
    code = "import json, sys; from docs.studies.device import study as s; "
    code += "s.p2(*json.loads(sys.argv[1])).tofile(sys.argv[2])"
    environment = {k: v for k, v in os.environ.items() if k not in SIMULATOR}
    with TemporaryDirectory() as folder:
        file = str(Path(folder, "p2"))
        command = [sys.executable, "-c", code, json.dumps([n, *case, "cpu"]), file]
        subprocess.run(command, env=environment, check=True)
        return np.fromfile(file).reshape(-1, n)


def differences(n: int, periods: int) -> list[dict[str, Any]]:
    """Greatest difference of p2 between CPU and device [mbar], by case."""
    rows = []
    for conditions in CONDITIONS:
        for closed in (False, True):
            case = (n, periods, conditions, closed)
            expected = p2_of_cpu(*case)
            greatest = float(np.max(np.abs(p2(*case, "cuda") - expected)) / 100)
            rows.append({"conditions": conditions, "closed": closed, "greatest_mbar": greatest})
    return rows


def policy_on_device(n: int) -> Callable[[Any], Any]:
    """From observations to actions, both on the device: a network of 64 x 64."""
    import torch

    layers: list[Any] = [
        torch.nn.LazyLinear(64),
        torch.nn.Tanh(),
        torch.nn.Linear(64, 64),
        torch.nn.Tanh(),
    ]
    network = torch.nn.Sequential(*layers, torch.nn.Linear(64, 2)).cuda()

    def act(observation: Any) -> Any:
        with torch.no_grad():
            logits = network(torch.as_tensor(observation, device="cuda"))
            return torch.distributions.Categorical(logits=logits).sample().to(torch.int64)

    return act


def rate(n: int, periods: int, conditions: str, closed: bool) -> float:
    """Simulated seconds a second with n valves."""
    envs, observation = made(n, conditions, "cuda", max_episode_steps=2000)
    fixed = cuda.to_device(np.random.default_rng(0).integers(0, 2, n))
    act = policy_on_device(n) if closed and not SIMULATED else lambda _: fixed
    begin = 0.0
    for k in range(periods + 1):
        if k == 1:  # the first compiles
            cuda.synchronize()
            begin = time.perf_counter()
        observation = envs.step(act(observation))[0]
    cuda.synchronize()
    return n * periods * PERIOD / (time.perf_counter() - begin)


def seconds_of(command: str) -> float:
    """Time that a command of training/ takes on the device [s]."""
    script, *words = command.split()
    begin = time.perf_counter()
    with TemporaryDirectory() as folder:
        more = ["--device", "cuda", "--out", str(Path(folder, "out"))]
        subprocess.run([sys.executable, f"training/{script}", *words, *more], check=True)
    return time.perf_counter() - begin


def device_name() -> str:
    """The accelerator in words."""
    name = "simulator" if SIMULATED else cuda.get_current_device().name
    return name.decode() if isinstance(name, bytes) else name  # by the version of numba-cuda


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; exit code 1 if the device disagrees with the CPU, before anything is timed."""
    options = study_options(study_parser(__doc__ or "", FOLDER), arguments)
    if not cuda.is_available():
        raise SystemExit(
            "no accelerator here: run it on one, or in the simulator (see the file's docstring)"
        )
    n, periods = (3, 12) if options.quick else (256, 400)
    checked = differences(n, periods)
    if worst := [row for row in checked if not row["greatest_mbar"] <= WITHIN_MBAR]:
        print(f"the device disagrees with the CPU, nothing is timed: {worst}", file=sys.stderr)
        return 1
    sizes, steps = ((2,), 2) if options.quick else ((4096, 65_536, 262_144), 400)
    timed = [
        {"valves": size, "conditions": c, "closed": closed, "rate": rate(size, steps, c, closed)}
        for size in sizes
        for c in CONDITIONS
        for closed in (False, True)
    ]  # fmt: skip
    commands = {} if options.quick else {command: seconds_of(command) for command in COMMANDS}
    found = {"device": device_name(), "checked": checked, "timed": timed, "commands": commands}
    write_text(options.out / "figures.json", json.dumps(found, indent=1) + "\n")
    fill(options.out / PAGE, pages(found))
    return 0


def pages(found: dict[str, Any]) -> dict[str, str]:
    """The generated parts of the page."""
    loops = {False: "random switching", True: "closed loop"}
    checks = [
        [row["conditions"], loops[row["closed"]], f"{row['greatest_mbar']:.1e}"]
        for row in found["checked"]
    ]
    times = [
        [f"{row['valves']:,}", row["conditions"], loops[row["closed"]],
         f"{row['rate']:,.0f}"]
        for row in found["timed"]
    ]  # fmt: skip
    commands = [[f"`{command}`", f"{seconds:.0f}"] for command, seconds in found["commands"].items()]
    return {
        "device": f"Measured on: {found['device']}.",
        "checks": table(["conditions", "loop", "greatest difference of p2 [mbar]"], checks),
        "rates": table(["valves", "conditions", "loop", "simulated seconds a second"], times),
        "commands": table(["command with `--device cuda`", "time [s]"], commands),
    }


if __name__ == "__main__":
    sys.exit(main())
