"""Whole episodes on an NVIDIA accelerator in one launch: plant, sensors, controller and figures.

A lane takes an episode from a queue, runs it to its end and takes the next one. An episode depends on
its start and on its own random numbers alone, so the number of lanes does not matter. Only what is
counted comes back to the host, which draws the starts in several processes.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from joblib import Parallel, delayed
from numba import cuda, float32, float64
from numpy.typing import NDArray

from controllers.base import Controller, OneValve, Privileged
from epv_env.actions import OnOff
from epv_env.device.kernels import COIL_ENERGY, NOISE, P2, WITH_EFFECTS, Batch, alone, launch, one_period
from epv_env.device.random import draw_normals
from epv_env.device.vector_env import on_device
from epv_env.observation import LAYOUT
from epv_env.period import observe, rules_of
from epv_env.plant.runge_kutta import DEFAULT_STEP
from epv_env.result import N_FIGURE
from epv_env.settings import Settings
from epv_env.task import LimitingTask
from training.evaluation.metrics import METER, EpisodeMetrics, count
from training.evaluation.rollout import begin_episodes, make_env

LANES = 262_144
"""Most threads of a launch: more than an accelerator of today runs at a time."""
DRAWN_AT_ONCE = 4096
"""Starts that a process draws: half a second's work."""
NEVER = -1
"""Instead of the period before which the control unit restarts."""
ENTRIES = len(LAYOUT)


@cache
def episodes_kernel(decide: Callable[..., Any], memory: np.dtype, with_effects: bool) -> Any:
    """The kernel that runs episodes under a controller of one valve (controllers.base.OneValve).

    decide: its compiled function. memory: its record. with_effects: whether some valve has effects.
    """
    take, meaning = one_period(with_effects), OnOff.rule

    @cuda.jit
    def run(b, queue, rules, constants, blank, keys, noise, periods, restart, meters, record):
        own, drawn = cuda.local.array(1, memory), cuda.local.array((1, 1, 4), float64)
        figures = cuda.local.array((N_FIGURE, 1), float64)
        seen = cuda.local.array((1, ENTRIES), float32)
        period, settling_time = rules[0].control_period, rules[0].settling_time
        while True:
            i = cuda.atomic.add(queue, 0, 1)
            if i >= len(meters):
                break
            v, e, m = alone(b, i), b.episodes[i], meters[i]
            observe(e, seen[0])
            for k in range(periods):
                if k == 0 or k == restart:
                    own[0] = blank[0]
                action = decide(own[0], seen[0], constants, period)
                if len(noise) == 0:
                    draw_normals(keys[i], 0, 0, k + 1, NOISE, e.noise, drawn[0, 0])
                else:
                    for c in range(4):
                        drawn[0, 0, c] = e.noise * noise[i, k + 1, c]
                on_time, share, _ = meaning(action, period, 1)
                take(v, rules, on_time, share, drawn, DEFAULT_STEP, figures, seen)
                count(m, figures, 0, v.numbers[COIL_ENERGY, 0], period, settling_time)
                if len(record) > 0:
                    record[k, 0, i], record[k, 1, i] = action, v.numbers[P2, 0]
                if m.failed > 0.0:
                    break

    return run


class Begun(NamedTuple):
    """Episodes that have begun on the host."""

    batch: Batch
    keys: NDArray
    """Of the random numbers of each episode's noise, (n,)."""

    @classmethod
    def of(cls, task: LimitingTask) -> "Begun":
        """The episodes of a task. Raises OptionError for what a device cannot follow."""
        keys = [rng.integers(2**64, dtype=np.uint64) for rng in task.noise_of if rng is not None]
        return cls(Batch.of(task), np.array(keys))


def takes(controller: Controller) -> bool:
    """Whether a controller decides on the device."""
    return isinstance(controller, OneValve) and not isinstance(controller, Privileged)


def run_begun(
    controller: OneValve,
    begun: Begun,
    settings: Settings,
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
        settings: of the environment.
        periods: after which an episode ends.
        restart: period before which the controller forgets everything.
        noise: instead of the device's own (n, periods + 1, 4) [-].
        record: (periods, 2, n), filled with decisions and p2 [Pa].
        lanes: threads.
    """
    n = len(begun.keys)
    kernel = episodes_kernel(
        type(controller).decide, controller.record, bool(np.any(begun.batch.numbers[WITH_EFFECTS]))
    )
    meters, kept = cuda.to_device(np.zeros(n, METER)), np.empty((0, 2, 0))
    kept = cuda.to_device(kept if record is None else record)
    launch(kernel, min(lanes, n), on_device(begun.batch), cuda.to_device(np.zeros(1, np.int64)),
           cuda.to_device(rules_of(settings)), on_device(controller.constants),
           cuda.to_device(np.zeros(1, controller.record)), cuda.to_device(begun.keys),
           cuda.to_device(np.empty((0, 0, 4)) if noise is None else noise), periods, restart, meters,
           kept)  # fmt: skip
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
    settings = make_env(controller, 1, **options).settings
    parts = [seeds[k : k + DRAWN_AT_ONCE] for k in range(0, len(seeds), DRAWN_AT_ONCE)]
    pool: Any = Parallel(n_jobs=-1 if len(parts) > 1 else 1)
    drawn = pool(delayed(_begun)(controller, part, options) for part in parts)
    arrays = zip(*(each.batch for each in drawn), strict=True)
    batch = Batch(*(np.concatenate(each, axis=-1) for each in arrays))
    begun = Begun(batch, np.concatenate([each.keys for each in drawn]))
    restart = NEVER if restart_s is None else round(restart_s / settings.control_period)
    periods = round(duration / settings.control_period)
    meters = run_begun(controller, begun, settings, periods=periods, restart=restart)
    return EpisodeMetrics.of(meters, settings.control_period)


def _begun(controller: Controller, seeds: Sequence[int], options: dict[str, Any]) -> Begun:
    """Episodes that begin with these seeds, as on the processor."""
    env = make_env(controller, len(seeds), **options)
    begin_episodes(env, controller, seeds)
    return Begun.of(env.task)
