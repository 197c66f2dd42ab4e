"""Switching model predictive control: try short on/off sequences on the simulation, take the best.

Every decision starts from the estimated state, holds the estimated consumption and supply, runs each
sequence of a fixed table through the plant, prices it as the reward does, adds what resting after it
would cost, and applies the first move of the cheapest. Sources: Kouro, Cortes, Vargas, Ammann and
Rodriguez, Model predictive control - a simple and powerful method to control power converters, IEEE
Trans. Industrial Electronics 56 (2009), for enumerating switch states; Rawlings, Mayne and Diehl, Model
Predictive Control (2nd ed., Nob Hill 2017), ch. 1 and 2, for what estimator and terminal cost are for.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controllers.estimator import Estimator
from controllers.mpc_prediction import PREDICTION, Decision, PredictionSettings, Predictor
from controllers.registration import SIMULATING, Range, Registration
from epv_env.common.units import BAR
from epv_env.observation import decode
from epv_env.plant.parameters import Parameters
from epv_env.reward import RewardWeights


@dataclass(kw_only=True)
class MPC:
    """Predicts with a nominal plant; knows the true plant by its sensors only."""

    parameters: Parameters
    """Of the nominal plant."""
    tail: float = 0.05
    """Time at rest that is priced after the horizon [s]: the terminal cost's weight."""
    floor: float = -0.1
    """p2 - target at which that rest ends, as a next pulse is due [bar]."""
    upkeep: float = 20.0
    """Price of time from then on [1/s]: what keeping the pressure costs on average."""
    setpoint: float = 0.0
    """p2 - target that is aimed at [bar]: a reserve against consumption yet to come."""
    reluctance: float = 0.0
    """Price by which switching now must beat waiting [1]. The estimate is noisy and may look different
    in the next period; waiting a period costs little."""
    act_below: float = 0.05
    """While p2 - target after the opening time lies above this, the coil stays on without a prediction
    [bar]: saves computing."""
    weights: RewardWeights = field(default_factory=RewardWeights)
    supply_voltage: float = 24.0
    """Of the coil when on [V]."""
    control_period: float = 5e-3
    """Period of the decisions [s]."""
    prediction: PredictionSettings = PREDICTION
    threads: int | None = None
    """Of the simulation; None: all cores."""
    name: str = "MPC"
    environment: str = "EPValve-v0"

    def __post_init__(self) -> None:
        self._estimator = Estimator(
            parameters=self.parameters, supply_voltage=self.supply_voltage,
            control_period=self.control_period, threads=self.threads,
        )  # fmt: skip

    def reset(self, n: int) -> None:
        """Estimators anew, all coils on, as every episode begins."""
        self._estimator.reset(n)
        self._on = np.ones(n, dtype=bool)
        self._predictor = Predictor(
            capacity=min(n, self.prediction.batch), tail=self.tail, floor=self.floor, upkeep=self.upkeep,
            weights=self.weights, supply_voltage=self.supply_voltage, control_period=self.control_period,
            threads=self.threads, settings=self.prediction,
        )  # fmt: skip

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve."""
        estimate = self._estimator.observe(observations, self._on)
        target = decode(observations, "target").astype(float) + self.setpoint
        soon = (estimate.state.p2 - self.prediction.opening_time * estimate.fall_rate) / BAR - target
        undecided = np.flatnonzero(~self._on | (soon < self.act_below))
        chosen = np.ones(len(observations), dtype=bool)
        batch = self.prediction.batch
        for first in range(0, len(undecided), batch):
            rows = undecided[first : first + batch]
            decision = Decision(estimate=estimate.of(rows), target=target[rows], coil=self._on[rows])
            switches = self._predictor.table[:, 0] != decision.coil[:, None]
            prices = self._predictor.prices(decision) + self.reluctance * switches
            best = np.argmin(prices, axis=1)
            chosen[rows] = self._predictor.table[best, 0]
        self._on = chosen
        return chosen.astype(np.int64)


REGISTRATION = Registration(
    kind="MPC",
    controller=MPC,
    build=lambda values, plant: MPC(
        parameters=plant.parameters, supply_voltage=plant.voltage, threads=1, **values
    ),
    search_space={
        "tail": Range(low=0.02, high=0.3, log=True),
        "floor": Range(low=-0.2, high=0.0),
        "upkeep": Range(low=5.0, high=40.0),
        "setpoint": Range(low=-0.05, high=0.15),
        "reluctance": Range(low=0.0, high=0.2),
    },
    cost=SIMULATING,
)
