"""The MPC's prediction: switching sequences run through the plant and priced by the reward."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controllers.estimator import StateEstimate
from epv_env.common.units import BAR
from epv_env.plant.equations import Inputs, State
from epv_env.plant.valves import Valves
from epv_env.reward import RewardWeights, reward_terms


@dataclass(frozen=True, kw_only=True)
class PredictionSettings:
    """Candidates of the prediction, and how exactly they are simulated."""

    horizon: int = 40
    """Length of the simulation [control periods]: venting to the opening pressure takes about 13 periods
    of 5 ms and 25 on a valve that opens late, shutting 5."""
    pulse_lengths: Mapping[int, Sequence[int]] = field(
        default_factory=lambda: {
            0: (*range(1, 21), *range(22, 35, 3)), 1: range(4, 20), 3: range(4, 20),
        }
    )  # fmt: skip
    """Lengths of the candidate pulses by the wait before them, both [control periods]. A later pulse has
    as fine a choice of lengths as one now: a coarser choice would make opening now look better."""
    step: float = 1e-3
    """Largest time step [s]: four times the plant's own, for an error of 2 mbar of a pulse."""
    opening_time: float = 0.07
    """Time from switching the coil off until air flows, about [s]."""
    tail_points: int = 8
    """Number of instants at which the rest after the horizon is priced."""
    batch: int = 16
    """Valves predicted at a time: bounds the memory."""


PREDICTION = PredictionSettings()
"""The MPC's prediction."""


def sequences(settings: PredictionSettings = PREDICTION) -> NDArray:
    """The candidates (candidates, horizon), bool coil states: rest, then single pulses between rests."""
    rows = [np.ones(settings.horizon, dtype=bool)]
    for wait, lengths in settings.pulse_lengths.items():
        for length in lengths:
            row = np.ones(settings.horizon, dtype=bool)
            row[wait : wait + length] = False
            rows.append(row)
    return np.array(rows)


@dataclass(frozen=True, kw_only=True)
class Decision:
    """The situation of m valves in which a switching sequence is to be chosen."""

    estimate: StateEstimate
    """Of the state of the m valves."""
    target: NDArray
    """Wanted p2 (m,) [bar]."""
    coil: NDArray
    """State of the coil until now (m,), bool."""


@dataclass(kw_only=True)
class Predictor:
    """Runs and prices the candidates for up to `capacity` valves at once."""

    capacity: int
    """Most valves of a decision."""
    tail: float
    """Time at rest that is priced after the horizon [s]."""
    floor: float
    """p2 - target at which a next pulse is due [bar]."""
    upkeep: float
    """Price of time from then on [1/s]: what keeping the pressure costs on average."""
    weights: RewardWeights
    """Prices of the reward."""
    supply_voltage: float
    """Of the coil when on [V]."""
    control_period: float
    """Period of the decisions [s]."""
    threads: int | None = None
    """Of the simulation; None: all cores."""
    settings: PredictionSettings = PREDICTION

    def __post_init__(self) -> None:
        self.table = sequences(self.settings)
        count = self.capacity * len(self.table)
        self._valves = Valves(count, step=self.settings.step, threads=self.threads)

    def prices(self, decision: Decision) -> NDArray:
        """Price (m, candidates) of every candidate; infinite where it cannot be integrated."""
        start, run = self._run(decision)
        before = np.broadcast_to(decision.coil[:, None], (1, *run.p2.shape[1:]))
        coil = np.concatenate([before, self._coils(len(decision.coil))])
        p2, vented = (
            np.concatenate([np.broadcast_to(first[:, None], (1, *later.shape[1:])), later])
            for first, later in ((start.p2, run.p2), (start.air_vented, run.air_vented))
        )
        error = p2 / BAR - decision.target[:, None]
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
        rest = self._rest(error[-1], decision.estimate.fall_rate[:, None] / BAR)
        price = rest - terms.total().sum(axis=0)
        return np.where(np.isnan(price), np.inf, price)

    def _coils(self, m: int) -> NDArray:
        """The candidates as (horizon, m, candidates)."""
        return np.repeat(self.table.T[:, None, :], m, axis=1)

    def _run(self, decision: Decision) -> tuple[State, State]:
        """States to start from, fields (m,), and those after every period, (horizon, m, candidates)."""
        m, candidates = len(decision.target), len(self.table)
        estimate, used = decision.estimate, m * candidates
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
        before; an error that is below it already stays so for the opening time.
        """
        part = self.tail / self.settings.tail_points
        price = self.settings.opening_time * self._holding(np.minimum(error - self.floor, 0.0))
        for k in range(self.settings.tail_points):
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
