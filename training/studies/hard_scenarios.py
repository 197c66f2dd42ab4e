"""Controllers on the scenarios beyond training, and on valves with one typical effect each."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from controllers.base import Privileged
from epv_env.plant.effects.registry import EFFECTS
from epv_env.reward import REFERENCE_PERIOD
from training.evaluation.effect_levels import effect_levels
from training.evaluation.hard_scenarios import HARD, HardScenario
from training.evaluation.metrics import EpisodeMetrics, summary
from training.evaluation.rollout import run_batches
from training.studies.episode_tasks import Study

SIDE_BY_SIDE = 1000
"""Episodes that are run together."""
LISTED = 100
"""Episodes that leave the band are named up to this many."""


def worn_scenarios() -> dict[str, HardScenario]:
    """A scenario for each effect of the catalogue, variant and sign, at its typical size."""
    return {
        f"worn: {name}": HardScenario(
            meaning="the valve or its sensors have this effect at its typical size",
            options={"effects": {_owner(sizes): sizes}},
        )
        for name, level, sizes in effect_levels()
        if level == "typical"
    }


def _owner(sizes: Mapping[str, float]) -> str:
    """The name of the effect that has these symbols."""
    return next(effect.name for effect in EFFECTS if set(sizes) <= set(effect.symbols))


def all_scenarios() -> dict[str, HardScenario]:
    """Every scenario by name."""
    return {**HARD, **worn_scenarios()}


def run_scenario(
    study: Study, label: str, scenario: HardScenario, seeds: Sequence[int]
) -> EpisodeMetrics:
    """Metrics of one of the study's controllers, an episode for each seed."""
    options: dict[str, Any] = {"plant": study.plant, **scenario.all_options}
    period = options.get("control_period", REFERENCE_PERIOD)
    controller = study.controller(label, period)
    if scenario.fault is not None and not isinstance(controller, Privileged):  # it has no memory
        controller = scenario.fault.around(controller, period)
    return run_batches(
        controller, seeds=seeds, duration=scenario.duration, options=options, size=SIDE_BY_SIDE
    )


def rows(
    study: Study, scenarios: Mapping[str, HardScenario], seeds: Sequence[int]
) -> Iterator[dict[str, Any]]:
    """`summary` of each scenario under each controller, as it is finished, and whose episodes left.

    `left_seeds` are the seeds of the first `LISTED` episodes that left the band.
    """
    for name, scenario in scenarios.items():
        for label in study.controllers:
            metrics = run_scenario(study, label, scenario, seeds)
            left = np.array(seeds)[~metrics.stayed][:LISTED]
            named = {"scenario": name, "controller": label}
            yield {**named, **summary(metrics), "left_seeds": left.tolist()}
