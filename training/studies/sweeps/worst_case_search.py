"""Worst-case search: the plant of a region and the consumption with the largest excursion of p2.

The search has four stages, each a few large batches:

1. A Latin hypercube of plants meets as many different episodes. The search keeps the episodes with the
   largest excursions.
2. In these episodes, differential evolution (Storn and Price 1997) varies the plant over the region.
3. Differential evolution varies the plant close to the worst one.
4. The worst plant meets as many new episodes as the first stage had.

The causal bound (controllers/causal_bound.py) then runs the worst episode: its excursion shows how much
of the searched controller's is the plant's and the consumption's.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from controllers.causal_bound import CausalBound
from epv_env.plant.consumption import MIXED, SCENARIOS
from epv_env.settings import as_region
from training.studies.episode_tasks import EXCURSION_DECIMALS, Study
from training.studies.sweeps.parameter_space import Space


@dataclass(frozen=True, kw_only=True)
class SearchSettings:
    """How a worst-case search shares its episodes out among its stages."""

    screened_per_held_episode: int = 64
    """Episodes of the first stage for each one that every plant of the middle stages meets."""
    least_held_episodes: int = 2
    screened_per_member: int = 32
    """Plants of the first stage for each plant of a generation."""
    least_population: int = 8
    generations_per_refinement: int = 3
    """Generations over the whole region for each one close to the worst plant."""
    refined_half_width: float = 0.05
    """Half the width of the box around the worst plant [1], as a share of the region's width."""


SETTINGS = SearchSettings()


@dataclass(frozen=True, kw_only=True)
class Effort:
    """How long to search."""

    screened: int
    """Plants, and episodes, of the first stage; episodes of the last one."""
    generations: int
    """Of plants over the whole region."""
    settings: SearchSettings = SETTINGS

    @property
    def held(self) -> int:
        """Episodes that every plant of the middle stages meets."""
        share = self.screened // self.settings.screened_per_held_episode
        return max(self.settings.least_held_episodes, share)

    @property
    def population(self) -> int:
        """Plants of a generation."""
        share = self.screened // self.settings.screened_per_member
        return max(self.settings.least_population, share)

    @property
    def refinements(self) -> int:
        """Generations close to the worst."""
        return max(1, self.generations // self.settings.generations_per_refinement)

    @property
    def episodes(self) -> int:
        """Episodes of a search."""
        bred = (self.generations + 1 + self.refinements + 1) * self.population * self.held
        return 2 * self.screened + bred


@dataclass
class _WorstEpisode:
    """The worst episode so far."""

    excursion_bar: float = -1.0
    coordinates: NDArray = field(default_factory=lambda: np.zeros(0))
    scenario: str = ""
    seed: int = 0


@dataclass(frozen=True, kw_only=True)
class Search:
    """A task (episode_tasks.py): one search for one controller over one region."""

    name: str
    controller: str
    region: str
    first_seed: int
    """Of the episodes that are met; the next ones follow."""
    seed: int
    """Of the search itself."""
    effort: Effort

    @property
    def episodes(self) -> int:
        """Episodes of the search."""
        return self.effort.episodes

    def run(self, study: Study) -> dict[str, Any]:
        """The worst plant, scenario and seed, its excursion, each stage's, and the bound's."""
        found = _RunningSearch(self, study).result()
        return {**found, "bound_bar": bound_excursion(study, found)}


def bound_excursion(study: Study, found: Mapping[str, Any]) -> float:
    """Excursion of the causal bound in the episode that a search found [bar]."""
    bound = replace(study, controllers={"bound": CausalBound()})
    each = {"scenario": [found["scenario"]], "parameters": [found["parameters"]]}
    metrics, _ = bound.run("bound", [found["seed"]], {}, each)
    return round(float(metrics.excursion_bar[0]), EXCURSION_DECIMALS)


class _RunningSearch:
    """A search under way: its parameter space, and the worst episode so far."""

    def __init__(self, search: Search, study: Study):
        self.search, self.study, self.effort = search, study, search.effort
        self.space = Space(region=as_region(search.region, study.plant))
        self.worst = _WorstEpisode()

    def result(self) -> dict[str, Any]:
        """Run all stages."""
        effort, stages = self.effort, {}
        first = self.space.latin_hypercube(effort.screened, self.search.seed)
        excursions = self._excursions(first, self._episodes(0))
        stages["hypercube"] = self.worst.excursion_bar
        farthest = np.argsort(-excursions, kind="stable")
        held = [self._episodes(0)[i] for i in farthest[: effort.held]]
        self._evolve(held, first[farthest[: effort.population]], 1.0, effort.generations)
        stages["whole region"] = self.worst.excursion_bar
        near = self.space.latin_hypercube(effort.population, self.search.seed + 1)
        near[0] = 0.5  # the best itself, in the middle of its box
        self._evolve(held, near, 2 * effort.settings.refined_half_width, effort.refinements)
        stages["close to the worst"] = self.worst.excursion_bar
        there = np.tile(self.worst.coordinates, (effort.screened, 1))
        self._excursions(there, self._episodes(effort.screened))
        stages["new consumption"] = self.worst.excursion_bar
        return {
            "parameters": self.space.values(self.worst.coordinates[None])[0],
            "scenario": self.worst.scenario,
            "seed": self.worst.seed,
            "excursion_bar": self.worst.excursion_bar,
            "stages_bar": stages,
            "episodes": self.search.episodes,
        }

    def _episodes(self, offset: int) -> list[tuple[str, int]]:
        """Scenario and seed of a stage's episodes; the scenarios of a mixture take turns."""
        names = list(SCENARIOS) if self.study.scenario == MIXED else [self.study.scenario]
        seeds = range(offset, offset + self.effort.screened)
        return [(names[i % len(names)], self.search.first_seed + i) for i in seeds]

    def _evolve(
        self, held: list[tuple[str, int]], population: NDArray, width: float, generations: int
    ) -> None:
        """Differential evolution of plants within a box of that width around the worst so far.

        population: (plants, symbols) within that box, from 0 to 1. width 1 is the whole region.
        """
        corner = np.clip(self.worst.coordinates - width / 2, 0.0, 1.0 - width)

        def negative_excursion(inside: NDArray) -> NDArray:
            """-worst excursion over the held episodes of plants (symbols, plants)."""
            coordinates = np.repeat(corner + width * inside.T, len(held), axis=0)
            excursions = self._excursions(coordinates, held * inside.shape[1])
            return -excursions.reshape(-1, len(held)).max(axis=1)

        settings: Any = {"init": population, "updating": "deferred", "polish": False, "tol": 0.0}
        differential_evolution(
            negative_excursion, [(0.0, 1.0)] * population.shape[1], maxiter=generations,
            rng=self.search.seed, vectorized=True, **settings,
        )  # fmt: skip

    def _excursions(self, coordinates: NDArray, episodes: list[tuple[str, int]]) -> NDArray:
        """Excursions (episodes,) [bar]: plant k, at coordinates (episodes, symbols), in episode k."""
        excursions = []
        for begin in range(0, len(episodes), self.effort.screened):
            part = slice(begin, begin + self.effort.screened)
            scenarios, seeds = zip(*episodes[part], strict=True)
            each = {"scenario": list(scenarios), "parameters": self.space.values(coordinates[part])}
            metrics, _ = self.study.run(self.search.controller, list(seeds), {}, each)
            excursions.append(metrics.excursion_bar)
        rounded = np.round(np.concatenate(excursions), EXCURSION_DECIMALS)
        at = int(np.argmax(rounded))
        if rounded[at] > self.worst.excursion_bar:
            self.worst = _WorstEpisode(float(rounded[at]), coordinates[at].copy(), *episodes[at])
        return rounded
