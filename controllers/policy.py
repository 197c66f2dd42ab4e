"""A learned policy as a controller: readings and learnt quantities in, a coil's state out.

The policy is a small net without memory. Its output is added to the advice of the adaptive pulse, and
rules and shields stand in front of it (controllers/knowledge.py). The controller believes p3, so it
comes with a check of that sensor (controllers/p3_check.py).
"""

from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from controllers.knowledge import ValveKnowledge
from controllers.p3_check import P3Check
from controllers.policy_files import Network, read_policy
from controllers.tuned import tuned
from epv_env.plant.plantfile import Plant, load_plant

TRAINED = Path(__file__).parent / "trained"
"""The policy that comes with the package."""
FALLBACK = "hysteresis, extrapolating"
"""Takes over where p3 is implausible: the best of the controllers that do not read it."""


@dataclass(kw_only=True)
class Policy:
    """The network behind the rules."""

    network: Network
    plant: Plant = field(repr=False)
    """The nominal plant, from which the valve learner starts."""
    control_period: float = 5e-3
    """[s]"""
    name: str = "PPO"
    environment: str = "EPValve-v0"
    knowledge: ValveKnowledge = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.knowledge = ValveKnowledge(self.plant, control_period=self.control_period)

    def reset(self, n: int) -> None:
        """Forget the valves; n episodes begin."""
        self.knowledge.reset(n)

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve, (n,)."""
        inputs = self.knowledge.observe(observations)
        off, on = self.network.logits(inputs).T
        return self.knowledge.overruled(np.where(off >= on, 0, 1))


def p3_checked(controller: Policy, plant: Plant) -> P3Check:
    """The controller with a check of its sensors, the best one that does not read p3 behind it."""
    fallback = tuned(FALLBACK, plant)
    return P3Check(main=controller, fallback=fallback, sensors=plant.sensors, name=controller.name)


def load_policy(
    folder: str | PathLike[str] = TRAINED, plant: Plant | str | PathLike[str] | None = None
) -> P3Check:
    """The whole controller from a policy's folder: network, learner, rules, and the check of p3.

    Args:
        folder: with policy.json and policy.safetensors; default: the package's own policy.
        plant: nominal plant or its file; None: the report's calibration.

    Raises PolicyError or PlantFileError if a file cannot be used.
    """
    contract, network = read_policy(folder)
    chosen = load_plant(plant)
    return p3_checked(Policy(network=network, plant=chosen, name=contract.name), chosen)
