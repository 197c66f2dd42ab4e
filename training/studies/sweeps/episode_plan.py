"""The episodes of a sweep: every point with every controller, cut into tasks."""

from collections.abc import Sequence
from dataclasses import dataclass

from epv_env.plant.plantfile import Plant
from training.evaluation.seeds import SWEEP_SEED
from training.studies.episode_tasks import Batch
from training.studies.sweeps.experiment_designs import ONE_AT_A_TIME, Point, hypercube, regions
from training.studies.sweeps.worst_case_search import Effort, Search

TASK_EPISODES = 512
"""Most episodes of a task: larger tasks gain little, and a stopped sweep loses its unfinished tasks."""

SEARCHED = ("confidence", "sensitive_ten_percent")
"""Regions in which the worst case is searched."""


@dataclass(frozen=True, kw_only=True)
class Size:
    """Numbers of episodes and plants."""

    episodes: int
    """Episodes at each point that changes one thing."""
    joint_episodes: int
    """Episodes at each region, and plants of the Latin hypercube."""
    effort: Effort


@dataclass(frozen=True, kw_only=True)
class SweepCell:
    """A point under one controller."""

    point: Point
    controller: str
    batches: list[Batch]


def chosen_points(
    plant: Plant, designs: Sequence[str], factors: Sequence[str], size: Size, seed: int
) -> list[Point]:
    """The points of some designs. factors: only these, where they change one thing; none: all.

    Raises ValueError for a factor that none of the designs changes.
    """
    single = [p for name, make in ONE_AT_A_TIME.items() if name in designs for p in make(plant)]
    known = dict.fromkeys(point.factor for point in single)
    unknown = [factor for factor in factors if factor not in known]
    if unknown:
        raise ValueError(
            f"no factor {', '.join(map(repr, unknown))} in the designs {', '.join(designs)}: choose "
            f"among {', '.join(known) or 'none'}"
        )
    points = list(regions(plant)) if "regions" in designs else []
    points += [point for point in single if not factors or point.factor in factors]
    if "hypercube" in designs:
        points.append(hypercube(plant, size.joint_episodes, seed))
    return points


def cells(points: Sequence[Point], controllers: Sequence[str], size: Size, seed: int) -> list[SweepCell]:
    """Every point under every controller, on the same seeds."""
    return [
        SweepCell(point=point, controller=name, batches=_batches(point, name, size, seed))
        for point in points
        for name in controllers
    ]


def _batches(point: Point, controller: str, size: Size, seed: int) -> list[Batch]:
    """A point's episodes under one controller, cut into tasks."""
    joint = point.design in ("regions", "hypercube")
    episodes = size.joint_episodes if joint else size.episodes
    return [
        Batch(
            name=f"{point.design}/{point.factor}/{point.level}/{controller}/{begin}",
            controller=controller,
            first_seed=SWEEP_SEED + seed + begin,
            episodes=min(TASK_EPISODES, episodes - begin),
            options=point.options,
            parameters=point.parameters[begin : begin + TASK_EPISODES] if point.parameters else None,
        )
        for begin in range(0, episodes, TASK_EPISODES)
    ]


def searches(plant: Plant, controllers: Sequence[str], size: Size, seed: int) -> list[Search]:
    """A worst-case search for every controller in every region that varies."""
    return [
        Search(
            name=f"worst/{region}/{name}", controller=name, region=region,
            first_seed=SWEEP_SEED + seed, seed=seed, effort=size.effort,
        )
        for region in SEARCHED
        if region != "confidence" or plant.region.varies
        for name in controllers
    ]  # fmt: skip
