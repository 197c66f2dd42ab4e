"""Many jobs side by side, in processes of one thread each."""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from itertools import cycle, islice
from multiprocessing import get_context
from multiprocessing.queues import Queue
from typing import Any

from threadpoolctl import threadpool_limits

from epv_env.common.results_folder import progress


def run_in_processes(
    function: Callable[..., Any], jobs: Sequence[tuple], *, workers: int, label: str
) -> Iterator[Any]:
    """Results of a function for the arguments of each job, in the order of completion.

    label: of the progress display.
    """
    if not jobs:
        return
    count, context = min(workers, len(jobs)), get_context("spawn")
    cores = context.Queue()
    for core in islice(cycle(_cores()), count):
        cores.put(core)
    pool = ProcessPoolExecutor(count, context, initializer=_confine, initargs=(cores,))
    try:
        futures = [pool.submit(function, *job) for job in jobs]
        for future in progress(as_completed(futures), what=label, total=len(jobs)):
            yield future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _cores() -> Sequence[int | None]:
    """Numbers of the cores that this process may use; None where the platform does not say."""
    return sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else [None]


def _confine(cores: Queue) -> None:
    """Keep a worker to one thread on one core: threads of two workers would wait for each other."""
    threadpool_limits(1)
    core = cores.get()
    if core is not None:
        os.sched_setaffinity(0, {core})
