"""Episodes as functions of standard normal numbers: their worst excursions under a controller.

The numbers stand where an episode draws from its three streams (epv_env/episode.py): first the plant's,
then those of pressures, target and consumption, then the noise of the sensors in the order of time. A
number drawn uniformly is the normal's probability. So the episodes have the distribution of all others,
and any change of the numbers is an episode again.
"""

from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from controllers.base import Controller, Privileged
from epv_env.common.units import BAR
from epv_env.episode import Start
from epv_env.period import NOISE_BLOCK
from epv_env.plant.channels import MEASURED
from epv_env.settings import Settings
from training.evaluation.rollout import make_env, run_begun
from training.rare.splitting import Moves

PLANT, DISTURBANCE = 128, 1024
"""Numbers of the first two streams: more than any region and any consumption draws."""


class NormalsAsDraws:
    """Stands for a numpy.random.Generator whose draws follow from given normals, one after another."""

    def __init__(self, normals: NDArray):
        self._normals = normals
        self._used = 0

    def standard_normal(self, size: Any = None, out: Any = None) -> Any:
        """The next normals."""
        shape = size if out is None else out.shape
        count = int(np.prod(shape or ()))
        taken = self._normals[self._used : self._used + count].reshape(shape or ())
        self._used += count
        if out is None:
            return taken
        out[...] = taken
        return out

    def random(self, size: Any = None) -> Any:
        """Between 0 and 1."""
        return ndtr(self.standard_normal(size))

    def uniform(self, low: Any = 0.0, high: Any = 1.0) -> Any:
        """Between two ends, numbers or arrays."""
        return low + (np.asarray(high) - low) * self.random(
            np.broadcast_shapes(np.shape(low), np.shape(high))
        )

    def integers(self, count: int) -> int:
        """From 0 on, below `count`."""
        return min(int(count * self.random()), count - 1)


@dataclass(frozen=True, kw_only=True)
class Episodes:
    """Episodes of one controller under one set of conditions."""

    controller: Controller
    """On a copy of which they run."""
    duration: float
    """Of an episode [s]."""
    options: dict[str, Any]
    """Of the environment; no conditions."""
    device: str = "cpu"
    """On which they run: "cpu", or "cuda" for an accelerator."""

    @property
    def settings(self) -> Settings:
        """Of the environment."""
        return make_env(self.controller, 1, **self.options).settings

    @property
    def moves(self) -> Moves:
        """Of the numbers behind an episode."""
        periods = round(self.duration / self.settings.control_period) + 1
        blocks = -(-periods // NOISE_BLOCK)
        return Moves(drawn=PLANT + DISTURBANCE, in_time=blocks * NOISE_BLOCK * len(MEASURED))

    def starts(self, normals: NDArray) -> list[Start]:
        """What is drawn of each episode (n, numbers)."""
        settings = self.settings
        ends = (PLANT, PLANT + DISTURBANCE)
        streams = [map(NormalsAsDraws, np.split(row, ends)) for row in normals]
        return [
            Start.from_streams(plant, disturbance, noise, settings)
            for plant, disturbance, noise in streams
        ]

    def worst(self, normals: NDArray) -> NDArray:
        """Largest |p2 - target| of each episode after the settling time, (n,) [bar].

        Infinite if the circuit empties. Raises OptionError for a controller that a device cannot run.
        """
        env = make_env(self.controller, len(normals), threads=1, **self.options)
        observation = env.task.begin_from(np.arange(len(normals)), self.starts(normals))
        controller: Any = deepcopy(self.controller)
        periods = round(self.duration / env.task.period)
        if self.device == "cpu":
            controller.reset(len(normals))
            if isinstance(controller, Privileged):
                controller.watch(env.task)
            m = run_begun(env, controller, observation, periods=periods)
        else:
            from training.evaluation import on_device  # compiles for an accelerator: of no use elsewhere

            begun, noise = on_device.Batch.of(env.task), normals[:, PLANT + DISTURBANCE :]
            noise = noise.reshape(len(normals), -1, len(MEASURED))
            m = on_device.run_begun(controller, begun, env.settings, periods=periods, noise=noise)
        return np.where(m["failed"] > 0, np.inf, m["excursion"])

    def described(self, normals: NDArray) -> list[dict[str, Any]]:
        """What makes the episodes of these normals (n, numbers), ready for JSON.

        "place": of each varying parameter between the ends of its range [1]; "p1_bar", "target_bar",
        "drop_bar": at the start; "applications": (start, rise, hold, fall [s], flow [kg/s]) of each
        that begins within the episode; "leak": [kg/s]; "worst_bar": excursion.
        """
        return [
            {
                "place": {
                    symbol: float((start.parameters[symbol] - low) / (high - low))
                    for symbol, (low, high) in start.region.boxes.items()
                },
                "p1_bar": start.p1 / BAR, "target_bar": float(start.target),
                "drop_bar": float(start.target - start.p2 / BAR), "leak": start.consumption.leak,
                "applications": [
                    row for row in start.consumption.applications.T.tolist() if row[0] < self.duration
                ],
                "worst_bar": float(worst),
            }
            for start, worst in zip(self.starts(normals), self.worst(normals), strict=True)
        ]  # fmt: skip
