"""Sharing the lanes of a batch among threads: compiled code runs outside of Python's lock."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise

from epv_env.plant.lanes import LANES

LANES_PER_TASK = 4 * LANES
"""Fewest lanes, times periods, worth a thread of their own."""


@cache
def _pool(process_id: int) -> ThreadPoolExecutor:
    """One pool per process: a forked child must not wait for its parent's threads."""
    return ThreadPoolExecutor(available_cores(), thread_name_prefix="epv-plant")


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def share(work: Callable[[int, int], None], lanes: int, *, threads: int, periods: int = 1) -> None:
    """Call work(first, last) for parts of the lanes, one part in each thread, this one included.

    Args:
        work: of lanes first..last, multiples of LANES.
        lanes: of the batch.
        threads: greatest number of parts.
        periods: that the work goes through; short work is not shared.
    """
    tasks = min(threads, lanes // LANES, lanes * periods // LANES_PER_TASK)
    if tasks <= 1:
        work(0, lanes)
        return
    edges = [lanes // LANES * part // tasks * LANES for part in range(tasks + 1)]
    others = [_pool(os.getpid()).submit(work, *ends) for ends in pairwise(edges[1:])]
    try:
        work(edges[0], edges[1])
    finally:
        for other in others:
            other.result()
