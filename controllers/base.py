"""The one protocol of all controllers: observations of a batch in, actions of a batch out."""

from typing import Protocol, runtime_checkable

from numpy.typing import NDArray

from epv_env.task import LimitingTask


class Controller(Protocol):
    """Decides for n valves at once from what an ECU can measure (epv_env.observation.LAYOUT)."""

    name: str
    """For tables and figures."""
    environment: str
    """Id of the environment whose actions it gives."""

    def reset(self, n: int) -> None:
        """Forget everything; n episodes begin."""
        ...

    def act(self, observations: NDArray) -> NDArray:
        """Actions for observations (n, entries), as the environment's action space wants them."""
        ...


@runtime_checkable
class Privileged(Controller, Protocol):
    """A controller that sees what no ECU measures: a bound for the others, not a rival."""

    def watch(self, task: LimitingTask) -> None:
        """See the episodes that have just begun; called after the environment's reset, before `act`."""
        ...
