"""Episodes in batches that run in several processes; what is finished stays finished.

A batch is data: it names a controller, seeds and conditions, so it gives the same figures, to the bit,
in whatever process and order it runs. Finished batches lie in a journal (epv_env/common/files.py).
"""

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from controllers.base import Controller, decides_on_device
from epv_env.common.field_types import numbers
from epv_env.common.files import Journal
from epv_env.common.results_folder import progress
from epv_env.plant.valves import available_cores
from training.evaluation.metrics import EpisodeMetrics
from training.evaluation.rollout import run_episodes
from training.evaluation.sensor_faults import Fault

BATCH_EPISODES = 512
"""Most episodes of a batch: larger ones are hardly faster, and a stopped run loses its unfinished
ones."""


DEVICE_EPISODES = 262_144
"""The same on an accelerator, which wants many."""


@dataclass(frozen=True, kw_only=True)
class Batch:
    """Episodes of one controller under one set of conditions, run side by side."""

    name: str
    """Its own in the journal."""
    controller: str
    """Label of the controller."""
    first_seed: int
    episodes: int
    duration: float
    """Of an episode [s]."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Of the environment."""
    restart_s: float | None = None
    """When the control unit restarts [s]; None: never."""
    faults: Sequence[Fault] = ()
    """Of the sensors that the controller reads."""
    device: str = "cpu"
    """On which they run: "cpu", or "cuda" for an accelerator, whose noise is another."""


def in_batches(whole: Batch) -> list[Batch]:
    """A batch in parts of at most BATCH_EPISODES, which have names of their own."""
    most, where = BATCH_EPISODES, ""
    if whole.device != "cpu":
        most, where = DEVICE_EPISODES, f", {whole.device}"
    parts = []
    for begin in range(0, whole.episodes, most):
        count = min(most, whole.episodes - begin)
        first = whole.first_seed + begin
        name = f"{whole.name}{where}, seeds {first} to {first + count - 1}"
        parts.append(replace(whole, name=name, first_seed=first, episodes=count))
    return parts


def run_batches(
    batches: Sequence[Batch],
    controllers: Mapping[str, Controller],
    *,
    journal: Journal | None = None,
    workers: int | None = 1,
    what: str,
) -> list[EpisodeMetrics]:
    """Figures of each batch, which is run in parts; parts in the journal are not run again.

    Args:
        batches: with names of their own.
        controllers: by label.
        journal: parts that are finished; new ones are added.
        workers: processes; None: one for each core. An accelerator has one, before the others begin.
        what: name of the progress bar.
    """
    parts = [in_batches(_placed(each, controllers)) for each in batches]
    finished: dict[str, Any] = {}
    missing = [p for each in parts for p in each if journal is None or p.name not in journal]
    with tqdm(
        total=sum(part.episodes for part in missing), desc=what, unit="episode", file=sys.stderr,
        mininterval=0.2 if sys.stderr.isatty() else 10.0,
    ) as bar:  # fmt: skip
        for name, figures in _results(missing, controllers, workers or available_cores()):
            finished[name] = figures
            if journal is not None:
                journal.add(name, figures)
            bar.update(len(figures["stayed"]))

    def metrics(part: Batch) -> EpisodeMetrics:
        if journal is None or part.name in finished:
            return kept_metrics(finished[part.name], part.episodes)
        return journal.read(part.name, partial(kept_metrics, episodes=part.episodes))

    return [EpisodeMetrics.joined([metrics(part) for part in each]) for each in parts]


def _placed(batch: Batch, controllers: Mapping[str, Controller]) -> Batch:
    """The batch on the processor if its controller decides nowhere else, or its sensors fail."""
    if batch.device == "cpu":
        return batch
    if not batch.faults and decides_on_device(controllers[batch.controller]):
        return batch
    return replace(batch, device="cpu")


def _results(
    parts: Sequence[Batch], controllers: Mapping[str, Controller], processes: int
) -> Iterator[tuple[str, dict[str, list[Any]]]]:
    """Names and figures of batches, as they end."""
    there, here = ([p for p in parts if (p.device == "cpu") == cpu] for cpu in (False, True))
    yield from (_run(part, controllers[part.controller]) for part in there)
    longest_first = sorted(here, key=lambda part: -part.episodes * part.duration)
    # Processes, not threads: most of an episode is NumPy on short arrays, which holds Python's lock.
    pool: Any = Parallel(n_jobs=processes, return_as="generator_unordered")
    yield from pool(delayed(_run)(part, controllers[part.controller]) for part in longest_first)


def run_jobs(
    jobs: Mapping[str, Callable[[], Any]], *, journal: Journal, workers: int | None, what: str
) -> list[Any]:
    """Results of jobs by name, JSON-ready, in their order; those in the journal are not run again.

    what: name of the progress bar.
    """
    missing = {name: job for name, job in jobs.items() if name not in journal}
    pool: Any = Parallel(n_jobs=workers or available_cores(), return_as="generator_unordered")
    done = pool(delayed(_named)(name, job) for name, job in missing.items())
    for name, result in progress(done, what=what, total=len(missing)):
        journal.add(name, result)
    return [journal[name] for name in jobs]


def _named(name: str, job: Callable[[], Any]) -> tuple[str, Any]:
    with threadpool_limits(1):
        return name, job()


def _run(batch: Batch, controller: Controller) -> tuple[str, dict[str, list[Any]]]:
    """Name and figures of a batch, each figure a list of the episodes' values, ready for JSON."""
    own: Any = deepcopy(controller)
    settings = {"threads": 1, "control_period": batch.options.get("control_period")}
    known = {name: v for name, v in settings.items() if v is not None and hasattr(own, name)}
    run: Callable[..., EpisodeMetrics] = run_episodes
    if batch.device != "cpu":
        from training.evaluation import on_device  # compiles for an accelerator: of no use elsewhere

        run = on_device.run_episodes
    with threadpool_limits(1):  # the figures must not depend on the threads of the linear algebra
        metrics = run(
            replace(own, **known) if known else own,
            seeds=range(batch.first_seed, batch.first_seed + batch.episodes),
            duration=batch.duration,
            options={"threads": 1, **batch.options},
            restart_s=batch.restart_s,
            **({"faults": batch.faults} if batch.faults else {}),
        )
    return batch.name, {name: np.asarray(v).tolist() for name, v in asdict(metrics).items()}


def kept_metrics(figures: Mapping[str, list[Any]], episodes: int) -> EpisodeMetrics:
    """Figures in a journal. Raises ValueError unless each is a number for each of so many episodes."""
    return EpisodeMetrics(**{name: numbers(values, episodes) for name, values in figures.items()})
