"""What a million episodes cost, on one machine and on a hundred, from the rates of this very sweep."""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from training.studies.episode_tasks import Study
from training.studies.parallel_run import Outcome, TaskRunner
from training.studies.sweeps.episode_plan import TASK_EPISODES, SweepCell

MILLION = 1_000_000


@dataclass(frozen=True, kw_only=True)
class CostSettings:
    """What the estimate assumes."""

    machines: int = 100
    """Machines like this one, beside one alone."""
    empty_tasks: int = 200
    """Tasks without work that are run to time the handing out of one."""


SETTINGS = CostSettings()


@dataclass(frozen=True, kw_only=True)
class EmptyTask:
    """A task that does nothing."""

    name: str
    episodes: int = 0

    def run(self, study: Study) -> dict[str, Any]:
        """Nothing."""
        return {}


def overhead(run: TaskRunner, study: Study, settings: CostSettings = SETTINGS) -> float:
    """Time from one empty task to the next [s]: how fast tasks can be handed out, whatever they do."""
    idle = [EmptyTask(name=str(k)) for k in range(settings.empty_tasks)]
    for _ in run(idle, study):  # starts the workers: those without work stop after minutes
        pass
    began = time.perf_counter()
    done = sum(1 for _ in run(idle, study))
    return (time.perf_counter() - began) / done


def episode_cpu(cells: Sequence[SweepCell], outcomes: Mapping[str, Outcome]) -> dict[str, float]:
    """Core time of an episode by controller [s], over the sweep's largest batches."""
    batches = [batch for cell in cells for batch in cell.batches]
    largest = max((batch.episodes for batch in batches), default=0)
    times: dict[str, list[tuple[float, int]]] = {}
    for batch in batches:
        if batch.episodes == largest:
            cpu = outcomes[batch.name]["cpu_s"]
            times.setdefault(batch.controller, []).append((cpu, batch.episodes))
    return {
        name: sum(cpu for cpu, _ in parts) / sum(n for _, n in parts) for name, parts in times.items()
    }


def million(cpu_s: float, overhead_s: float, *, cores: int, machines: int) -> float:
    """Time of a million episodes [s]: each core computes its share, one scheduler hands all tasks out.

    As if no task began before all were handed out: an upper bound of what handing out adds.
    """
    return MILLION * cpu_s / (cores * machines) + math.ceil(MILLION / TASK_EPISODES) * overhead_s


def cost(
    cpu_s: Mapping[str, float],
    overhead_s: float,
    *,
    cores: int,
    where: str,
    duration: float,
    settings: CostSettings = SETTINGS,
) -> dict[str, Any]:
    """Rates and what follows from them, ready for JSON.

    Args:
        cpu_s: core time of an episode by controller [s].
        overhead_s: time of handing out a task [s].
        cores: of a machine.
        where: what handed the tasks out.
        duration: length of an episode [s].
        settings: the number of machines.
    """

    def of_machines(cpu: float, machines: int) -> float:
        """Time of a million episodes on so many machines [s]."""
        return million(cpu, overhead_s, cores=cores, machines=machines)

    return {
        "episode_duration_s": duration,
        "cores_of_a_machine": cores,
        "tasks_handed_out_by": where,
        "episodes_of_a_task": TASK_EPISODES,
        "overhead_of_a_task_s": overhead_s,
        "controllers": {
            name: {
                "core_s_per_episode": cpu,
                "million_on_one_machine_s": of_machines(cpu, 1),
                f"million_on_{settings.machines}_machines_s": of_machines(cpu, settings.machines),
            }
            for name, cpu in cpu_s.items()
        },
    }
