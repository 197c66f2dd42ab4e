"""The oracle's beam search: on/off sequences as a tree on the simulation, narrowed layer by layer."""

from copy import deepcopy
from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from controllers.oracle_nodes import MERGE_TOLERANCE, MergeTolerance, Nodes
from epv_env.common.units import BAR
from epv_env.plant.equations import State
from epv_env.plant.valves import Valves
from epv_env.reward import EMPTY_CIRCUIT_BAR, RewardWeights, reward_terms
from epv_env.task import LimitingTask


class Search:
    """Searches ahead of n running episodes from where they stand, without touching them."""

    def __init__(
        self,
        task: LimitingTask,
        width: int,
        threads: int | None,
        weights: RewardWeights | None = None,
        tolerance: MergeTolerance = MERGE_TOLERANCE,
    ):
        """
        Args:
            task: n episodes, just begun or under way.
            width: nodes kept of a layer.
            threads: of the simulation; None: all cores.
            weights: prices of the reward; None: the task's.
            tolerance: within which two nodes count as the same.

        Raises:
            ValueError: a plant's coil follows its voltage with a delay.
        """
        plants = [p for p in task.parameters if p is not None]
        if any(p["t_delay"] > 0 for p in plants):
            raise ValueError(
                "the oracle does not know a coil that follows its voltage late: give plants with "
                "t_delay = 0, or leave the oracle out"
            )
        self._task, self._width, self._tolerance = task, width, tolerance
        self._weights = weights or task.settings.weights
        self.depth = 0
        """Layers that lie ahead of the episodes."""
        self._steps = task.steps.copy()
        self._consumption = deepcopy(task.consumption)
        self._valves = Valves(task.n * 2 * width, threads=threads)
        self._owner = np.repeat(np.arange(task.n), 2 * width)
        p = {symbol: np.array([plant[symbol] for plant in plants]) for symbol in plants[0]}
        volume = np.array([supply.volume for supply in task.supplies])
        self._valves.set_parameters(
            np.arange(self._valves.n), {s: v[self._owner] for s, v in p.items()}, volume[self._owner]
        )
        self._air_per_pressure = (p["V3"] / (p["R_gas"] * p["T_env"]))[:, None]
        self.nodes = self._root()

    def _root(self) -> Nodes:
        shape = (self._task.n, self._width)

        def spread(values: NDArray) -> NDArray:
            return np.repeat(values[:, None], self._width, axis=1)

        price = np.full(shape, np.inf)
        price[:, 0] = 0.0
        return Nodes(
            state=State(*map(spread, self._task.valves.state)), price=price,
            compressor=spread(self._task.compressor), coil=spread(self._task.coil),
            moves=np.zeros(shape, dtype=np.uint64),
        )  # fmt: skip

    def expand(self) -> None:
        """One layer more: both children of every node, then the best that differ."""
        places = np.tile(np.arange(self._width), 2)
        parents = self.nodes.take(np.broadcast_to(places, (self._task.n, 2 * self._width)))
        coil = np.broadcast_to(np.repeat([False, True], self._width), parents.coil.shape)
        compressor = self._drive(parents, coil)
        state = State(*(field.reshape(coil.shape) for field in self._valves.state))
        children = Nodes(
            state=state, compressor=compressor, coil=coil,
            price=parents.price + self._priced(parents, state, coil),
            moves=(parents.moves << np.uint64(1)) | coil.astype(np.uint64),
        )  # fmt: skip
        rank = self._distinct(children)
        best = np.argsort(rank, axis=1, kind="stable")[:, : self._width]
        self.nodes = children.take(best)
        self.nodes.price[np.take_along_axis(rank, best, axis=1) == np.inf] = np.inf
        self._steps += 1
        self.depth += 1

    def decide(self) -> NDArray:
        """The first move (n,) of each best node; nodes that began otherwise are dropped."""
        self.depth -= 1
        first = (self.nodes.moves >> np.uint64(self.depth)) & np.uint64(1)
        best = np.argmin(self.nodes.price, axis=1)[:, None]
        chosen = np.take_along_axis(first, best, axis=1)
        self.nodes.price[first != chosen] = np.inf
        self.nodes.price[:] -= np.min(self.nodes.price, axis=1, keepdims=True)
        return chosen[:, 0].astype(np.int64)

    def _drive(self, parents: Nodes, coil: NDArray) -> NDArray:
        """Run every child through its period as the task does; returns the compressors' states."""
        task, valves = self._task, self._valves
        time = self._steps * task.period
        for field, values in zip(valves.state, parents.state, strict=True):
            field[:] = values.ravel()
        compressor, refill = parents.compressor, np.zeros(coil.shape)
        slope = np.zeros(task.n)
        for i, supply in enumerate(task.supplies):
            compressor[i] = supply.compressor_runs(parents.state.p1[i], compressor[i], time[i])
            refill[i] = supply.delivery * compressor[i]
            slope[i] = supply.slope(time[i : i + 1], task.period)[0]
        inputs = valves.inputs
        inputs.U[:] = np.where(coil, task.settings.supply_voltage, 0.0).ravel()
        inputs.sigma_S[:] = self._consumption.mean_flow(time, task.period)[self._owner]
        inputs.refill[:] = refill.ravel()
        inputs.p1_slope[:] = slope[self._owner]
        valves.forget_extremes()
        valves.advance(np.where(parents.price < np.inf, task.period, 0.0).ravel())
        return compressor

    def _priced(self, parents: Nodes, state: State, coil: NDArray) -> NDArray:
        """Price of the period by the reward, (n, 2 width); infinite where there is no node."""
        task, target = self._task, self._task.target[:, None]
        present = (parents.price < np.inf) & ~np.isnan(state.p2)
        highest, lowest = (
            np.where(present, values.reshape(coil.shape), state.p2) / BAR - target
            for values in (self._valves.highest_p2, self._valves.lowest_p2)
        )
        terms = reward_terms(
            self._weights,
            period=task.period,
            error_bar=state.p2 / BAR - target,
            highest_error_bar=highest,
            lowest_error_bar=lowest,
            switchings=coil ^ parents.coil,
            vented_kg=state.air_vented - parents.state.air_vented,
            failed=state.p2 <= EMPTY_CIRCUIT_BAR * BAR,
        )
        return np.where(present, -terms.total(), np.inf)

    def _invested(self, nodes: Nodes) -> NDArray:
        """Price of opening the valve that has not paid yet: vented control chamber, switching off."""
        vented = np.maximum(nodes.state.p1 - nodes.state.p3, 0.0) * self._air_per_pressure
        return self._weights.vented_air * 1e3 * vented + self._weights.switching * ~nodes.coil

    def _distinct(self, nodes: Nodes) -> NDArray:
        """Ranks (n, k), price less investment; infinite but for the best node of each cell."""
        present = np.isfinite(nodes.price)
        rank = np.where(present, nodes.price - self._invested(nodes), np.inf)
        cells = [
            np.rint(np.where(present, getattr(nodes.state, name), 0.0) / tolerance).ravel()
            for name, tolerance in asdict(self._tolerance).items()
        ]
        keys = [*cells, nodes.coil.ravel(), self._owner]
        order = np.lexsort([rank.ravel(), *keys])
        differs = np.any([key[order][1:] != key[order][:-1] for key in keys], axis=0)
        best = order[np.concatenate([[True], differs])]
        kept = np.full(rank.size, np.inf)
        kept[best] = rank.ravel()[best]
        return kept.reshape(rank.shape)
