"""Adaptive MPC: the predictive controller on a model that follows its valve.

Indirect adaptive control: what the valve's own pulses tell (controllers/valve_learner.py) becomes
parameters of the model that estimates and predicts, and the controller treats them as true (certainty
equivalence; Åström and Wittenmark, Adaptive Control, 2nd ed. 1995, chapter 3).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from controllers.mpc import MPC
from controllers.mpc import REGISTRATION as NOMINAL
from controllers.pulse_simulation import nominal_table
from controllers.pulse_table import PulseTable
from controllers.registration import Range
from controllers.valve_learner import LearntValve, ValveLearner


@dataclass(kw_only=True)
class AdaptiveMPC(MPC):
    """Predicts with each valve's learnt opening pressure, gain of a pulse and venting rate."""

    table: PulseTable
    """Pulses of the nominal plant."""
    filter_time: float
    """Time in which the weight of a reading of p2 fades by 1/e, for the learner [s]."""
    name: str = "MPC, adaptive"
    _learner: ValveLearner = field(init=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        self._learner = ValveLearner(
            self.table, filter_time=self.filter_time, control_period=self.control_period
        )

    def reset(self, n: int) -> None:
        """Forget consumption and valves; n episodes begin."""
        super().reset(n)
        self._learner.reset(n)

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve, (n,)."""
        valve = self._learner.observe(observations)
        self._estimator.assume(learnt_parameters(self.parameters, valve))
        action = super().act(observations)
        self._learner.decided(action)
        return action


def learnt_parameters(nominal: Mapping[str, float], valve: LearntValve) -> dict[str, NDArray]:
    """The parameters that give the model the learnt behaviour, by symbol (n,).

    The spring's preload shifts the opening pressure, the solenoid valve's contraction scales the venting
    rate, and the protection valve's scales what a pulse adds.
    """
    return {
        "xPV0": np.asarray(valve.table.parameters["xPV0"]),
        "alphaMV": nominal["alphaMV"] * valve.pace,
        "alphaPV": nominal["alphaPV"] * valve.gain,
    }


REGISTRATION = replace(
    NOMINAL,
    kind="MPC, adaptive",
    controller=AdaptiveMPC,
    build=lambda values, plant: AdaptiveMPC(
        table=nominal_table(plant),
        parameters=plant.parameters, supply_voltage=plant.voltage, threads=1, **values,
    ),
    search_space={
        **(NOMINAL.search_space or {}),
        "filter_time": Range(low=0.004, high=0.04, log=True, least=0.001, most=0.4),
    },
    cost=replace(NOMINAL.cost, paired_random_episodes=32),
)  # fmt: skip
"""The MPC that finds out which valve it has."""
