"""Whole episodes on an NVIDIA accelerator in one launch: plant, sensors, controller and figures.

The host draws the starts, in several processes. Only what is counted comes back to it.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from joblib import Parallel, delayed
from numba import cuda
from numpy.typing import NDArray

from controllers.base import Controller, OneValve, Privileged
from epv_env.device.kernels import WITH_EFFECTS, Batch, episodes_kernel, launch
from epv_env.device.vector_env import on_device
from epv_env.period import rules_of
from epv_env.plant.runge_kutta import DEFAULT_STEP
from epv_env.signals import OptionError
from epv_env.task import LimitingTask
from training.evaluation.metrics import METER, EpisodeMetrics, count
from training.evaluation.rollout import begin_episodes, make_env

LANES = 262_144
"""Most threads of a launch: more than an accelerator of today runs at a time."""
DRAWN_AT_ONCE = 4096
"""Starts that a process draws: half a second's work."""
NEVER = -1
"""Instead of the period before which the control unit restarts."""


class Begun(NamedTuple):
    """Episodes that have begun on the host."""

    batch: Batch
    keys: NDArray
    """Of the random numbers of each episode's noise, (n,)."""
    rules: NDArray
    """A record of RULES, (1,)."""

    @classmethod
    def of(cls, task: LimitingTask, keys: NDArray | None = None) -> "Begun":
        """The episodes of a task, by default with keys of their own. Raises OptionError as Batch.of."""
        if keys is None:
            own = [rng.integers(2**64, dtype=np.uint64) for rng in task.noise_of if rng is not None]
            keys = np.array(own)
        return cls(Batch.of(task), keys, rules_of(task.settings))


def takes(controller: Controller) -> bool:
    """Whether a controller decides on the device."""
    return isinstance(controller, OneValve) and not isinstance(controller, Privileged)


def run_begun(
    controller: Any,
    begun: Begun,
    *,
    periods: int,
    restart: int = NEVER,
    noise: NDArray | None = None,
    record: NDArray | None = None,
    lanes: int = LANES,
) -> NDArray:
    """Run episodes on the device; returns records of METER (n,).

    Args:
        controller: that `takes` takes.
        begun: the episodes.
        periods: after which an episode ends.
        restart: period before which the controller forgets everything.
        noise: instead of the device's own (n, more than `periods`, 4) [-].
        record: (periods, 2, n), filled with decisions and p2 [Pa].
        lanes: threads.

    Raises OptionError for another controller.
    """
    if not takes(controller):
        raise OptionError(f'{controller.name} decides on the processor: leave out the device "cuda"')
    b, n = begun.batch, len(begun.keys)
    with_effects = bool(np.any(b.numbers[WITH_EFFECTS]))
    kernel = episodes_kernel(type(controller).decide, controller.record, count, with_effects)
    kept = cuda.to_device(np.empty((0, 2, 0)) if record is None else record)
    noise = cuda.to_device(np.empty((0, 0, 0)) if noise is None else noise)
    meters, queue = cuda.to_device(np.zeros(n, METER)), cuda.to_device(np.zeros(1, np.int64))
    blank = cuda.to_device(np.zeros(1, controller.record))
    launch(kernel, min(lanes, n), *on_device((b, begun.keys, begun.rules, controller.constants)), blank,
           noise, periods, restart, DEFAULT_STEP, queue, meters, kept)  # fmt: skip
    if record is not None:
        kept.copy_to_host(record)
    return meters.copy_to_host()


def run_episodes(
    controller: OneValve,
    *,
    seeds: Sequence[int],
    duration: float,
    options: dict[str, Any],
    restart_s: float | None = None,
) -> EpisodeMetrics:
    """`rollout.run_episodes` on the device, whose noise is another."""
    parts = [seeds[k : k + DRAWN_AT_ONCE] for k in range(0, len(seeds), DRAWN_AT_ONCE)]
    pool: Any = Parallel(n_jobs=-1 if len(parts) > 1 else 1)
    batches, keys, rules = zip(
        *pool(delayed(_begun)(controller, p, options) for p in parts), strict=True
    )
    batch = Batch(*(np.concatenate(each, axis=-1) for each in zip(*batches, strict=True)))
    begun, period = Begun(batch, np.concatenate(keys), rules[0]), rules[0][0].control_period
    restart = NEVER if restart_s is None else round(restart_s / period)
    meters = run_begun(controller, begun, periods=round(duration / period), restart=restart)
    return EpisodeMetrics.of(meters, period)


def _begun(controller: Controller, seeds: Sequence[int], options: dict[str, Any]) -> Begun:
    """Episodes that begin with these seeds, as on the processor."""
    env = make_env(controller, len(seeds), **options)
    begin_episodes(env, controller, seeds)
    return Begun.of(env.task)
