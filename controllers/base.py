"""The protocol of all controllers: observations of a batch in, actions of a batch out."""

from typing import Protocol, runtime_checkable

from numpy.typing import NDArray

from epv_env.task import LimitingTask


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
