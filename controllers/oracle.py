"""The oracle: a search with privileged information that shows about the best possible control.

It knows states, parameters and the future, and serves for comparison only. It searches the on/off
sequences of the look-ahead on the plant's own simulation under the consumption that is to come, breadth
first: every kept node has two children, coil off and coil on; of nodes in nearly the same state the best
stays, and of those the best `width`. When the look-ahead is full, the oracle applies the first move of
the best node and drops nodes that began with another, so that a decision costs one layer (the truncated
Viterbi algorithm: Forney, The Viterbi algorithm, Proc. IEEE 61 (1973); keeping a layer narrow is beam
search: Russell and Norvig, Artificial Intelligence, 4th ed., ch. 4). Nodes are ranked by their price so
far, less what was invested to open the valve and has not paid yet. A wider layer comes nearer to the
optimum and takes longer.
"""

from dataclasses import dataclass

from numpy.typing import NDArray

from controllers.oracle_nodes import LONGEST_LOOK
from controllers.oracle_search import Search
from controllers.registration import SIMULATING, Registration
from epv_env.reward import RewardWeights
from epv_env.task import LimitingTask


@dataclass(kw_only=True)
class Oracle:
    """Acts on the task that it watches and ignores the measurements."""

    width: int = 128
    """Nodes kept for each episode."""
    look_ahead: int = 60
    """Control periods of foresight."""
    weights: RewardWeights | None = None
    """Prices of what it avoids; None: those of the task."""
    threads: int | None = None
    name: str = "oracle"
    environment: str = "EPValve-v0"
    _task: LimitingTask | None = None
    _search: Search | None = None

    def __post_init__(self) -> None:
        if self.width < 1:
            raise ValueError(f"width = {self.width}: an oracle keeps at least 1 node")
        if not 1 <= self.look_ahead <= LONGEST_LOOK:
            raise ValueError(f"look_ahead = {self.look_ahead}: give 1 to {LONGEST_LOOK} periods")

    def watch(self, task: LimitingTask) -> None:
        """See the episodes that have begun (controllers.base.Privileged)."""
        self._task, self._search = task, None

    def reset(self, n: int) -> None:
        """Forget the search; the task that is watched stays."""
        self._search = None

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve. Raises ValueError if no task is watched."""
        if self._task is None:
            raise ValueError("the oracle sees no task: call watch(env.task) after the reset")
        if self._search is None:
            self._search = Search(self._task, self.width, self.threads, self.weights)
        while self._search.depth < self.look_ahead:
            self._search.expand()
        return self._search.decide()


REGISTRATION = Registration(
    kind="oracle",
    controller=Oracle,
    build=lambda values, plant: Oracle(threads=1),
    search_space=None,
    cost=SIMULATING,
)
