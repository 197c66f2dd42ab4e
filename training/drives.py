"""Drives of simulated valves, as a control unit reads them: as arrays, or as an operation log."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from controllers.base import Controller, Privileged
from epv_env.actions import OnOff
from epv_env.observation import decode
from epv_env.operation_log import OperationLog
from epv_env.plant.plantfile import Plant
from epv_env.plant.valves import Valves
from training.evaluation.rollout import begin_episodes, make_env

DRIVE = 30.0
"""Length of a drive [s]."""


def check_can_log(controller: Controller) -> None:
    """Raises ValueError unless a control unit with this controller could write a log."""
    if controller.environment != "EPValve-v0" or isinstance(controller, Privileged):
        raise ValueError(
            f"{controller.name!r} cannot have written a log: give a controller for EPValve-v0 that "
            "needs no more than the sensors"
        )


def write_log(
    folder: Path,
    controller: Controller,
    plant: Plant,
    seeds: Iterable[int],
    *,
    duration: float = DRIVE,
    scenario: str = "mixed",
    effects: Mapping[str, Any] | None = None,
    onset: int = 0,
    begun: Callable[[Valves], object] = lambda valves: None,
) -> None:
    """Drive a valve once for each seed, and log it; a drive whose circuit empties ends there.

    Args:
        folder: new, or without files.
        controller: decides.
        plant: the valve.
        seeds: of the drives.
        duration: of a drive [s].
        scenario: consumption.
        effects: of the valve from drive number `onset` on, by name: sizes by symbol [SI].
        onset: 0 for all drives.
        begun: is called with the valve when a drive begins.

    Raises:
        ValueError: the controller can write no log, or the folder holds files.
    """
    check_can_log(controller)
    steps = round(duration / OnOff.default_period)
    made = gymnasium.make("EPValve-v0", plant=plant, scenario=scenario, max_episode_steps=steps)
    env = OperationLog(made, folder)
    for number, seed in enumerate(seeds):
        acting = effects if effects and number >= onset else {}
        observation, _ = env.reset(seed=seed, options={"effects": acting})
        begun(env.valve.task.valves)
        controller.reset(1)
        ended = False
        while not ended:
            action = int(controller.act(observation[None])[0])
            observation, _, failed, out_of_time, _ = env.step(action)
            ended = failed or out_of_time
    env.close()


def drives(
    plant: Plant,
    controller: Controller,
    seeds: Sequence[int],
    chosen: dict[str, Any],
    *,
    voltage: float = 1.0,
    duration: float = DRIVE,
    begun: Callable[[Valves], object] = lambda valves: None,
) -> NDArray:
    """What the control unit reads, (drives, periods, 6): coil, U [V], p1, p2, p3 [bar], I [A].

    chosen: options of the reset, lists with an entry for each drive. voltage: share of the plant's.
    begun: is called with the valves when the drives begin.
    """
    options = {"plant": plant, "threads": 1, "supply_voltage": voltage * plant.voltage}
    env = make_env(controller, len(seeds), **options)
    observation = begin_episodes(env, controller, seeds, chosen)
    begun(env.task.valves)
    rows = np.empty((len(seeds), round(duration / env.settings.control_period), 6))
    rows[:, :, 1] = env.settings.supply_voltage
    for k in range(rows.shape[1]):
        action = controller.act(observation)
        p2 = decode(observation, "target") + decode(observation, "p2_error")
        read = [decode(observation, name) for name in ("p1", "p3", "I")]
        rows[:, k, 0], rows[:, k, 2:] = action, np.stack([read[0], p2, read[1], read[2]], axis=-1)
        observation = env.advance(action).observation
    return rows
