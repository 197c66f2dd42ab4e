"""The one protocol of all controllers: observations of a batch in, actions of a batch out."""

from typing import Protocol

from numpy.typing import NDArray


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
