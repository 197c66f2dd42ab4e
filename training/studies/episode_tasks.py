"""Tasks of a study: data that any process can run, and their results, ready for JSON."""

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, field, fields, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from controllers.base import Controller
from epv_env.plant.plantfile import Plant
from training.evaluation.metrics import EpisodeMetrics
from training.evaluation.rollout import Trace, run_episodes

EXCURSION_DECIMALS = 6
"""Decimals of an excursion that is kept [bar]."""


@dataclass(frozen=True, kw_only=True)
class Study:
    """What all tasks share. The study is sent whole, so that a worker elsewhere needs no files."""

    controllers: Mapping[str, Controller]
    """By the name that tasks call them."""
    plant: Plant
    scenario: str
    """Consumption, where a task names no other."""
    duration: float
    """Of an episode [s]."""

    def run(
        self,
        controller: str,
        seeds: list[int],
        options: Mapping[str, Any],
        each: Mapping[str, list[Any]] | None = None,
        trace_of: int | None = None,
    ) -> tuple[EpisodeMetrics, Trace | None]:
        """`run_episodes` on the study's plant and consumption, unless options or each say otherwise."""
        chosen = self.controller(controller, options.get("control_period"))
        own = {"plant": self.plant, "scenario": self.scenario, "threads": 1, **options}
        return run_episodes(
            chosen, seeds=seeds, duration=self.duration, options=own, each=dict(each or {}),
            trace_of=trace_of,
        )  # fmt: skip

    def controller(self, name: str, control_period: float | None = None) -> Controller:
        """A copy of a controller, in one thread, and with another control period [s] if it has one."""
        chosen: Any = deepcopy(self.controllers[name])
        settings = {"threads": 1, "control_period": control_period}
        known = {k: v for k, v in settings.items() if v is not None and hasattr(chosen, k)}
        return replace(chosen, **known) if known else chosen


class Task(Protocol):
    """Does its work on a Study alone: the same result, to the bit, wherever it runs."""

    @property
    def name(self) -> str:
        """Its own in the sweep."""
        ...

    @property
    def episodes(self) -> int:
        """Episodes that it runs, about."""
        ...

    def run(self, study: Study) -> dict[str, Any]:
        """The result, ready for JSON."""
        ...


@dataclass(frozen=True, kw_only=True)
class Batch:
    """Episodes of one controller under one set of conditions, run side by side."""

    name: str
    controller: str
    first_seed: int
    episodes: int
    options: dict[str, Any] = field(default_factory=dict)
    """Of the environment."""
    parameters: list[dict[str, float]] | None = None
    """A plant of its own for each episode; None: as the options say."""

    def run(self, study: Study) -> dict[str, Any]:
        """`condensed` metrics."""
        seeds = list(range(self.first_seed, self.first_seed + self.episodes))
        each = {} if self.parameters is None else {"parameters": self.parameters}
        metrics, _ = study.run(self.controller, seeds, self.options, each)
        return condensed(metrics)


def condensed(metrics: EpisodeMetrics) -> dict[str, Any]:
    """What a sweep keeps of n episodes: every excursion, and sums of all figures, which can be added."""
    columns = {each.name: np.asarray(getattr(metrics, each.name)) for each in fields(metrics)}
    n = len(metrics.stayed)
    return {
        "episodes": n,
        "left": int(n - metrics.stayed.sum()),
        "excursion_bar": np.round(metrics.excursion_bar, EXCURSION_DECIMALS).tolist(),
        "figures": {
            name: _sums(values.astype(float))
            for name, values in columns.items()
            if values.shape == (n,) and values.dtype.kind in "fi"
        },
    }


def _sums(values: NDArray) -> dict[str, float | None]:
    """Number, sum, sum of squares and greatest of the finite values (n,)."""
    finite = values[np.isfinite(values)]
    return {
        "count": len(finite),
        "sum": float(finite.sum()),
        "squares": float(np.sum(finite**2)),
        "greatest": float(finite.max()) if len(finite) else None,
    }
