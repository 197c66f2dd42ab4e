"""Running tasks on this machine's cores or on a Dask cluster; what is finished stays finished."""

import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypedDict

from joblib import Parallel, delayed
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from epv_env.common.files import Journal
from training.studies.episode_tasks import Study, Task

CLUSTER_TIMEOUT = 60
"""Longest wait for a cluster's first worker [s]."""


class Outcome(TypedDict):
    """The result of a task, and its computing time."""

    result: dict[str, Any]
    cpu_s: float
    """Time that its thread computed [s]."""


TaskRunner = Callable[[Iterable[Task], Study], Iterator[tuple[str, Outcome]]]
"""Runs tasks side by side; yields name and outcome in the order in which they finish."""


def run_tasks(
    tasks: Sequence[Task], study: Study, journal: Journal, run: TaskRunner, *, what: str
) -> dict[str, Outcome]:
    """Outcomes by name, in the order of the tasks; those in the journal are not run again.

    The longest tasks begin first, so that none is left running alone at the end.

    Args:
        tasks: of a study, each with a name of its own.
        study: what all tasks share.
        journal: outcomes of an earlier run; new outcomes are added to it.
        run: where the tasks run (`task_runner`).
        what: name of the progress bar.
    """
    missing = [task for task in tasks if task.name not in journal]
    size = {task.name: task.episodes for task in missing}
    quiet = 0.2 if sys.stderr.isatty() else 10.0
    with tqdm(
        total=sum(size.values()), desc=what, unit="episode", file=sys.stderr, mininterval=quiet
    ) as bar:
        for name, outcome in run(sorted(missing, key=lambda task: -task.episodes), study):
            journal.add(name, outcome)
            bar.update(size[name])
    return {task.name: journal[task.name] for task in tasks}


@contextmanager
def task_runner(workers: int, cluster: str | None) -> Iterator[TaskRunner]:
    """Where tasks run: as many processes of this machine, or a Dask cluster by its address.

    Processes, not threads: most of an episode is NumPy on short arrays, which holds Python's lock.
    Raises ValueError if no scheduler answers, or it has no worker.
    """
    if cluster is None:
        yield _on_cores(workers)
        return
    from distributed import Client  # takes a second to import: only now

    try:
        client = Client(cluster, timeout=f"{CLUSTER_TIMEOUT}s")
    except (OSError, ValueError) as error:
        raise ValueError(
            f"no Dask scheduler answers at {cluster} ({error}): start one with `dask scheduler` and "
            "give the address that it prints"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=CLUSTER_TIMEOUT)
        except TimeoutError:
            raise ValueError(
                f"the scheduler at {cluster} has no worker after {CLUSTER_TIMEOUT} s: start `dask "
                f"worker {cluster} --nthreads 1 --nworkers auto` on each machine"
            ) from None
        yield lambda tasks, study: _on_cluster(client, tasks, study)


def _on_cores(workers: int) -> TaskRunner:
    """Runs tasks in so many processes of this machine."""

    def run(tasks: Iterable[Task], study: Study) -> Iterator[tuple[str, Outcome]]:
        pool: Any = Parallel(n_jobs=workers, return_as="generator_unordered")
        yield from pool(delayed(_run_one)(task, study) for task in tasks)

    return run


def _on_cluster(client: Any, tasks: Iterable[Task], study: Study) -> Iterator[tuple[str, Outcome]]:
    """A task whose worker dies is run again elsewhere, and so is the one that holds the study."""
    from distributed import as_completed

    shared = client.submit(_unchanged, study, pure=False)
    futures = client.map(_run_one, list(tasks), study=shared, pure=False)
    try:
        for _, outcome in as_completed(futures, with_results=True):
            yield outcome
    finally:
        client.cancel(futures)


def _unchanged(study: Study) -> Study:
    """The study itself, so that the cluster keeps one copy for all tasks."""
    return study


def _run_one(task: Task, study: Study) -> tuple[str, Outcome]:
    """Run a task in one thread: so its result does not depend on how many the linear algebra has."""
    began = time.thread_time()
    with threadpool_limits(1):
        result = task.run(study)
    return task.name, {"result": result, "cpu_s": time.thread_time() - began}
