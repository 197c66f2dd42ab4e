"""A program of its own: SubprocVecEnv with every start method. Prints what agrees with this process.

epv_env is imported within functions only, so that the worker has to find it through the id.
"""

import multiprocessing
from typing import Any

import gymnasium
import numpy as np

THREADED = 256


def threaded_result() -> float:
    """Something that every thread of a threaded batch had a part in."""
    from tests.env.rollouts import actions, native, run

    found = run(native("EPValve-v0", THREADED, threads=2), actions("EPValve-v0", THREADED, 3))
    return float(np.sum(found.steps[-1].observation, dtype=float))


def put_result(queue: multiprocessing.Queue) -> None:
    queue.put(threaded_result())


def make_single() -> gymnasium.Env:
    return gymnasium.make("epv_env:EPValve-v0")


def worker_agrees(method: str) -> bool:
    """A worker process steps as an environment here does."""
    from stable_baselines3.common.vec_env import SubprocVecEnv

    from tests.env.rollouts import actions, native

    worker: Any = SubprocVecEnv([make_single], start_method=method)
    here = native("EPValve-v0", 1)
    worker.seed(3)
    same = np.array_equal(worker.reset(), here.reset(seed=3)[0])
    for command in actions("EPValve-v0", 1, 5):
        same &= np.array_equal(worker.step(command)[0], here.step(command)[0])
    worker.close()
    return bool(same)


def child_gets(expected: float) -> bool:
    """A forked child, which has none of its parent's threads, can run a threaded batch."""
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=put_result, args=(queue,))
    child.start()
    found = queue.get(timeout=60)
    child.join()
    return found == expected


def main() -> None:
    expected = threaded_result()  # the parent's threads are running from here on
    for method in ("fork", "forkserver", "spawn"):
        print(method, worker_agrees(method))
    print("threads", child_gets(expected))


if __name__ == "__main__":
    main()
