"""A learned policy as a controller: readings and learnt quantities in, a coil's state out.

The policy is a small net without memory. Its output is added to the advice of the adaptive pulse, and
rules and shields stand in front of it (controllers/knowledge.py). The controller believes its readings,
so the check of the sensors comes first (controllers/sensor_check.py).
"""

from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.base import OneValve, compiled, over_batch
from controllers.hysteresis import Hysteresis, Thresholds
from controllers.knowledge import INPUTS, describe, forced
from controllers.network import Network, Weights, forward
from controllers.policy_files import read_policy
from controllers.pulse import Knowledge, nominal_knowledge
from controllers.sensor_check import SENSES, Ends, checked, ends_of, overruled
from controllers.tuned import tuned
from controllers.valve_learner import VALVE
from epv_env.plant.plantfile import Plant, load_plant

TRAINED = Path(__file__).parent / "trained"
"""The policy that comes with the package."""
FALLBACK = "extrapolating hysteresis"
"""Takes over where sensors fail: the best of the controllers that do not read p3."""


class Parts(NamedTuple):
    """What all valves of a policy share, for compiled code."""

    ends: Ends
    fallback: Thresholds
    knowledge: Knowledge
    weights: Weights


@compiled
def decide(m, r, observation, c, period):
    """One valve's decision (controllers.base.OneValve). c: Parts."""
    checked(m.senses, r, observation, c.ends, c.fallback, period)
    describe(m.valve, r, observation, c.knowledge, period, m.inputs)
    force = forced(m.valve, r.error)
    forward(c.weights, m.inputs, m.signals)
    off = force < 0 or (force == 0 and m.signals[0, 0] >= m.signals[0, 1])
    return 1.0 if force > 1 else overruled(m.senses, 0.0 if off else 1.0)


@dataclass(kw_only=True)
class Policy(OneValve):
    """The network behind the rules, and the check of the sensors before both."""

    network: Network
    plant: Plant = field(repr=False)
    """The nominal plant, from which the valve learner starts; its sensors are checked."""
    control_period: float = 5e-3
    """[s]"""
    name: str = "PPO"
    environment: str = "EPValve-v0"
    decide, decide_all = staticmethod(decide), over_batch(decide)

    def __post_init__(self) -> None:
        fallback = tuned(FALLBACK, self.plant)
        assert isinstance(fallback, Hysteresis)
        signals = self.network.signals
        self.record = np.dtype((np.record, [
            ("senses", SENSES), ("valve", VALVE),
            ("inputs", np.float32, (INPUTS,)), ("signals", signals.dtype, signals.shape),
        ]))  # fmt: skip
        self.constants = Parts(
            ends_of(self.plant.sensors), fallback.constants, nominal_knowledge(self.plant),
            self.network.weights,
        )  # fmt: skip

    @property
    def failed(self) -> NDArray:
        """Whether p3 was implausible or readings were lost since the reset, bool (n,)."""
        return self.memory["senses"]["failed"] > 0


def load_policy(
    folder: str | PathLike[str] = TRAINED, plant: Plant | str | PathLike[str] | None = None
) -> Policy:
    """The whole controller from a policy's folder: network, learner, rules, and the check of sensors.

    Args:
        folder: with policy.json and policy.safetensors; default: the package's own policy.
        plant: nominal plant or its file; None: the report's calibration.

    Raises PolicyError or PlantFileError if a file cannot be used.
    """
    contract, network = read_policy(folder)
    period = contract.observation.control_period_s
    return Policy(network=network, plant=load_plant(plant), name=contract.name, control_period=period)
