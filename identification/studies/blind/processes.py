"""Many jobs side by side, in processes of one thread each."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from typing import Any

from threadpoolctl import threadpool_limits

from epv_env.common.progress import progress


def run_in_processes(
    function: Callable[..., Any], jobs: Sequence[tuple], *, workers: int, label: str
) -> Iterator[Any]:
    """Results of a function for the arguments of each job, in the order of completion.

    label: of the progress display.
    """
    if not jobs:
        return
    pool = ProcessPoolExecutor(
        min(workers, len(jobs)), get_context("spawn"), initializer=threadpool_limits, initargs=(1,)
    )
    try:
        futures = [pool.submit(function, *job) for job in jobs]
        for future in progress(as_completed(futures), what=label, total=len(jobs)):
            yield future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
