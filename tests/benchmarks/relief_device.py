"""The relief valve (relief_valve.py) on an NVIDIA accelerator: a thread for each trajectory."""

import time

from numba import float64

from epv_env.device.kernels import cuda, launch
from tests.benchmarks.relief_valve import (
    MOST_STEPS,
    N_ROW,
    PASSED,
    RUNNING,
    Result,
    Task,
    begin,
    settle,
    stepper,
)

try_step = stepper(1)


@cuda.jit
def trajectories(flows, step, transient, impacts, maxima, passed):
    """All of a task; the results are arrays as in Result."""
    own = cuda.grid(1)
    if own >= len(flows):
        return
    work = cuda.local.array((N_ROW, 1), float64)
    begin(work, 0, flows[own], 1.0)
    for _ in range(MOST_STEPS):
        if try_step(work, step):
            settle(work, 0, transient, impacts[own], maxima[own])
            if work[RUNNING, 0] == 0.0:
                break
    passed[own] = work[PASSED, 0]


def run_device(task: Task, step: float) -> tuple[Result, float]:
    """As `run_lanes`, with the time that the device takes [s]."""
    found = Result.empty(task)
    arrays = {name: cuda.to_device(each) for name, each in vars(found).items()}
    flows = cuda.to_device(task.flows)
    begun = time.perf_counter()
    launch(trajectories, task.flows.size, flows, step, task.transient, *arrays.values())
    cuda.synchronize()
    took = time.perf_counter() - begun
    return Result(**{name: each.copy_to_host() for name, each in arrays.items()}), took
