"""The protocol of all controllers, and controllers of one valve that run over a batch of them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar, Protocol, runtime_checkable

import numba
import numpy as np
from numba.extending import register_jitable
from numpy.typing import NDArray

from epv_env import observation
from epv_env.common.compilation import announce_compilation
from epv_env.observation import READINGS, read
from epv_env.plant.primitives import source_digest
from epv_env.task import LimitingTask

compiled: Callable[..., Any] = register_jitable(error_model="numpy", no_cfunc_wrapper=True)
"""Decorator of the functions of one valve."""
composed: Callable[..., Any] = numba.njit(error_model="numpy", inline="always")
"""Decorator of those that mainly call others: numba compiles them together with their caller, once."""

# Closed over by the loops: numba's cache on disk notices a change in their own file only.
DIGEST = source_digest(*Path(__file__).parent.glob("*.py"), Path(observation.__file__))
"""Of all functions that a loop over a batch may call."""


class Controller(Protocol):
    """Decides for n valves at once from measurements of an ECU (epv_env.observation.LAYOUT)."""

    name: str
    """Name in tables and figures."""
    environment: str
    """Id of the environment that its actions are for."""

    def reset(self, n: int) -> None:
        """Forget everything; n episodes begin."""
        ...

    def act(self, observations: NDArray) -> NDArray:
        """Actions of the environment's action space for observations (n, entries).

        Shape (n,) for the on/off environment, (n, 1) for the PWM environment.
        """
        ...


@runtime_checkable
class Privileged(Controller, Protocol):
    """A controller with privileged information, which no ECU measures: a bound for the others."""

    def watch(self, task: LimitingTask) -> None:
        """Take in the episodes that have just begun; called after the environment's reset."""
        ...


def over_batch(decide: Callable[..., Any]) -> Any:
    """A compiled function of one valve, `OneValve.decide`, over a batch: `OneValve.decide_all`."""
    digest = DIGEST

    @numba.njit(cache=True, nogil=True, error_model="numpy")
    def decide_all(memory, observations, constants, period, actions):
        if digest == "":
            return
        readings = np.zeros(1, READINGS)[0]
        for i in range(len(memory)):
            read(readings, observations[i])
            actions[i] = decide(memory[i], readings, observations[i], constants, period)

    return decide_all


class OneValve:
    """A controller of one valve, over a batch of n.

    Its memory of a valve is a record, whose zeros mean that an episode begins. The compiled function
    `decide(memory, readings, observation, constants, period)` of its file may change the first three,
    and gives 1 (coil on) or 0. readings: the observation (entries,), read into a record of READINGS.
    C is translated from what it calls, and an accelerator compiles it, too.
    """

    decide: ClassVar[Any]
    decide_all: ClassVar[Any]
    """`over_batch` of it: (memory, observations, constants, period, actions)."""
    record: np.dtype
    """Of a valve's memory."""
    constants: Any
    """A named tuple of numbers and arrays that all valves share."""
    control_period: float
    """[s]"""
    memory: Any
    """Records (n,)."""

    def reset(self, n: int) -> None:
        """Forget everything; n episodes begin."""
        announce_compilation()
        self.memory = np.zeros(n, self.record)

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve's observation (n, entries), as (n,)."""
        actions = np.empty(len(observations), dtype=int)
        seen = np.array(observations, dtype=np.float32)
        type(self).decide_all(self.memory, seen, self.constants, self.control_period, actions)
        return actions


def decides_on_device(controller: Controller) -> bool:
    """Whether an accelerator can run the controller: it acts by its compiled function alone."""
    return getattr(type(controller), "act", None) is OneValve.act
