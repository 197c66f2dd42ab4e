"""What the MPC foresees: a table of sequences run through the plant and priced as the reward does."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controllers.estimator import Estimate
from epv_env.common.units import BAR
from epv_env.plant.equations import Inputs, State
from epv_env.plant.valves import Valves
from epv_env.reward import RewardWeights, reward_terms

HORIZON = 28
"""Control periods simulated: venting to the opening pressure takes about 13 of 5 ms, shutting 5."""

PULSES = {0: range(1, 21), 1: range(4, 20), 3: range(4, 20)}
"""Periods that the coil is off, by the periods that it is on before. Lengths are as fine later as now:
else opening now would look better than waiting, for its choice of lengths alone."""

STEP = 1e-3
"""Largest step of the prediction [s]: four times the plant's own, for 2 mbar of a pulse."""

LEAD = 0.07
"""Time from switching the coil off until air flows, about [s]."""

TAIL_POINTS = 8
"""Instants at which the rest after the horizon is priced."""

CHUNK = 16
"""Valves predicted at a time: bounds the memory."""


def sequences() -> NDArray:
    """The table (candidates, HORIZON) of coil states: rest, then single pulses with rest after them."""
    rows = [np.ones(HORIZON, dtype=bool)]
    for wait, lengths in PULSES.items():
        for length in lengths:
            row = np.ones(HORIZON, dtype=bool)
            row[wait : wait + length] = False
            rows.append(row)
    return np.array(rows)


@dataclass(frozen=True, kw_only=True)
class Question:
    """What is to be decided for m valves."""

    estimate: Estimate
    target: NDArray
    """What p2 is to be (m,) [bar]."""
    coil: NDArray
    """Its state until now (m,), bool."""


@dataclass(kw_only=True)
class Predictor:
    """Runs and prices the table for up to `capacity` valves at once."""

    capacity: int
    tail: float
    """Time at rest that is priced after the horizon [s]."""
    floor: float
    """p2 - target at which a next pulse is due [bar]."""
    upkeep: float
    """Price of time from then on [1/s]: what keeping the pressure costs on average."""
    weights: RewardWeights
    supply_voltage: float
    control_period: float
    threads: int | None = None
    table: NDArray = field(default_factory=sequences)

    def __post_init__(self) -> None:
        self._valves = Valves(self.capacity * len(self.table), step=STEP, threads=self.threads)

    def prices(self, asked: Question) -> NDArray:
        """Price (m, candidates) of every candidate; infinite where it cannot be integrated."""
        start, run = self._run(asked)
        coil = np.concatenate(
            [np.broadcast_to(asked.coil[:, None], (1, *run.p2.shape[1:])), self._coils(len(asked.coil))]
        )
        p2, vented = (
            np.concatenate([np.broadcast_to(first[:, None], (1, *later.shape[1:])), later])
            for first, later in ((start.p2, run.p2), (start.air_vented, run.air_vented))
        )
        error = p2 / BAR - asked.target[:, None]
        terms = reward_terms(
            self.weights,
            period=self.control_period,
            error_bar=error[1:],
            highest_error_bar=np.maximum(error[1:], error[:-1]),
            lowest_error_bar=np.minimum(error[1:], error[:-1]),
            switchings=coil[1:] ^ coil[:-1],
            vented_kg=np.diff(vented, axis=0),
            failed=np.zeros(error[1:].shape, dtype=bool),
        )
        price = self._rest(error[-1], asked.estimate.falling[:, None] / BAR) - terms.total().sum(axis=0)
        return np.where(np.isnan(price), np.inf, price)

    def _coils(self, m: int) -> NDArray:
        """The table as (HORIZON, m, candidates)."""
        return np.repeat(self.table.T[:, None, :], m, axis=1)

    def _run(self, asked: Question) -> tuple[State, State]:
        """States to start from, fields (m,), and those after every period, (HORIZON, m, candidates)."""
        m, candidates = len(asked.target), len(self.table)
        estimate, used = asked.estimate, m * candidates
        for field_, value in zip(self._valves.state, estimate.state, strict=True):
            field_[:used] = np.repeat(value, candidates)
        lanes = {symbol: np.repeat(value, candidates) for symbol, value in estimate.parameters.items()}
        self._valves.set_parameters(np.arange(used), lanes)
        U = np.zeros((len(self.table.T), self._valves.n))
        U[:, :used] = self.supply_voltage * self._coils(m).reshape(-1, used)
        consumption, period = np.zeros((2, self._valves.n))
        consumption[:used] = np.repeat(estimate.consumption, candidates)
        period[:used] = self.control_period
        run = self._valves.record(Inputs(U, consumption, np.zeros(1), np.zeros(1)), period)
        return estimate.state, State(*(row[:, :used].reshape(-1, m, candidates) for row in run))

    def _rest(self, error: NDArray, falling: NDArray) -> NDArray:
        """Price of resting for the tail from an error [bar] that falls at a rate [bar/s].

        Once the error has reached the floor a next pulse is due and time costs the upkeep, whatever went
        before; an error that is below it already stays so for LEAD.
        """
        part = self.tail / TAIL_POINTS
        price = LEAD * self._holding(np.minimum(error - self.floor, 0.0))
        for k in range(TAIL_POINTS):
            then = error - falling * (k + 0.5) * part
            price += part * np.where(then > self.floor, self._holding(then), self.upkeep)
        return price

    def _holding(self, error: NDArray) -> NDArray:
        """Price of staying at an error [1/s]."""
        none = np.zeros(1)
        terms = reward_terms(
            self.weights, period=1.0, error_bar=error, highest_error_bar=error, lowest_error_bar=error,
            switchings=none, vented_kg=none, failed=none,
        )  # fmt: skip
        return -terms.total()
