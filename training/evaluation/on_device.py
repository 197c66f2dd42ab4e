"""Whole episodes on an NVIDIA accelerator in one launch: plant, sensors, controller and figures.

The host draws the starts, in several processes. Only what is counted comes back to it.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numba import cuda
from numpy.typing import NDArray

from controllers.base import decides_on_device
from epv_env.device.kernels import KERNEL, Batch, episodes_kernel, launch
from epv_env.device.vector_env import on_device
from epv_env.period import rules_of
from epv_env.settings import Settings
from epv_env.signals import OptionError
from training.evaluation.metrics import METER, EpisodeMetrics, count
from training.evaluation.rollout import NEVER, NOTHING, begin_episodes, make_env

LANES = 262_144
"""Most threads of a launch: more than an accelerator of today runs at a time."""
DRAWN_AT_ONCE = 4096
"""Starts that a process draws: half a second's work."""


def run_begun(
    controller: Any,
    begun: Batch,
    settings: Settings,
    *,
    periods: int,
    restart: int = NEVER,
    noise: NDArray = NOTHING,
    record: NDArray = NOTHING,
    lanes: int = LANES,
) -> NDArray:
    """Run episodes that have begun on the host; returns records of METER (n,).

    Args:
        controller: one that `decides_on_device`.
        begun: the episodes.
        settings: of the environment.
        periods: after which an episode ends.
        restart: period before which the controller forgets everything.
        noise: instead of the device's own (n, more than `periods`, 4) [-].
        record: filled with decisions and p2 [Pa], (periods, 2, n).
        lanes: threads.

    Raises OptionError for another controller.
    """
    if not decides_on_device(controller):
        raise OptionError(f'{controller.name} decides on the processor: leave out the device "cuda"')
    number = int(np.max(begun.numbers[KERNEL]))
    kernel = episodes_kernel(type(controller).decide, controller.record, count, number)
    meters, kept = cuda.to_device(np.zeros(len(begun.keys), METER)), cuda.to_device(record)
    launch(kernel, min(lanes, len(begun.keys)), on_device(begun), cuda.to_device(rules_of(settings)),
           on_device(controller.constants), cuda.to_device(np.zeros(1, controller.record)),
           cuda.to_device(noise), periods, restart, cuda.to_device(np.zeros(1, np.int64)),
           meters, kept)  # fmt: skip
    kept.copy_to_host(record)
    return meters.copy_to_host()


def run_episodes(
    controller: Any,
    *,
    seeds: Sequence[int],
    duration: float,
    options: dict[str, Any],
    restart_s: float | None = None,
) -> EpisodeMetrics:
    """`rollout.run_episodes` on the device, whose noise is another."""
    settings = make_env(controller, 1, **options).settings
    parts = [seeds[k : k + DRAWN_AT_ONCE] for k in range(0, len(seeds), DRAWN_AT_ONCE)]
    pool: Any = Parallel(n_jobs=-1 if len(parts) > 1 else 1)
    drawn = pool(delayed(_begun)(controller, part, options) for part in parts)
    begun = Batch(*(np.concatenate(each, axis=-1) for each in zip(*drawn, strict=True)))
    period = settings.control_period
    restart = NEVER if restart_s is None else round(restart_s / period)
    periods = round(duration / period)
    meters = run_begun(controller, begun, settings, periods=periods, restart=restart)
    return EpisodeMetrics.of(meters, period)


def _begun(controller: Any, seeds: Sequence[int], options: dict[str, Any]) -> Batch:
    """Episodes that begin with these seeds, as on the processor."""
    env = make_env(controller, len(seeds), **options)
    begin_episodes(env, controller, seeds)
    return Batch.of(env.task)
