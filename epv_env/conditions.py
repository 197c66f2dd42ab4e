"""What an episode may meet beyond the ordinary, each with a probability of its own."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Annotated, Any

from epv_env.common.field_types import shown
from epv_env.signals import OptionError, Range, check_count, check_known, check_limits

Probability = Annotated[float, (0.0, 1.0)]


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """Probabilities of an episode, each drawn on its own, and the ranges of what is then drawn.

    The conditions act in the order of their probabilities. Ranges are uniform unless their field says
    otherwise. All probabilities are 0 by default: the ordinary episode, to the bit.
    """

    starved: Probability = 0.0
    """Probability that the supply begins near or below the target and is refilled later."""
    starved_bar: Annotated[Range, (-5.0, 5.0)] = (-0.5, 1.5)
    """How far this supply begins below the target [bar]; below 0 it begins above."""
    starved_s: Annotated[Range, (0.0, 3600.0)] = (0.5, 4.0)
    """When its refill begins [s]; it lasts less than a second."""
    far: Probability = 0.0
    """Probability that the circuit begins anywhere between almost empty and full: a first filling."""
    least_p2_bar: Annotated[float, (1.51, 16.0)] = 1.6
    """Emptiest circuit with which an episode begins [bar]; at 1.5 the episode would have failed."""
    vented: Probability = 0.0
    """Probability that the coil has been off for long: the control chamber is empty, the valve open."""
    vented_drop_bar: Annotated[Range, (0.0, 16.0)] = (3.0, 4.4)
    """How far a vented valve's circuit begins below the target [bar]: the valve shuts so late that from
    less than 3 bar the overshoot could not be avoided."""
    coil_off: Probability = 0.0
    """Probability that the magnet valve begins released, over a filled control chamber: a restart."""
    rest: Probability = 0.0
    """Probability that the first application comes later, as while a vehicle rolls."""
    rest_s: Annotated[Range, (0.1, 3600.0)] = (2.0, 120.0)
    """How much later [s], log-uniform: short rests are common, and cheap to simulate."""
    target_steps: Probability = 0.0
    """Probability that the target steps, four times at most."""
    target_step_s: Annotated[Range, (0.01, 3600.0)] = (1.0, 4.0)
    """Time from one step to the next [s]."""
    target_step_bar: Annotated[Range, (-5.0, 5.0)] = (0.1, 0.5)
    """Height of a step [bar]; below 0 it falls, which only consumption lets the circuit follow."""
    noisy: Probability = 0.0
    """Probability that the sensors' noise has another size."""
    noise_factor: Annotated[Range, (0.0, 1000.0)] = (0.0, 4.0)
    """Factor of `sensor_noise` [-], from a clean reading to four times Table 3's."""
    frozen_p3: Probability = 0.0
    """Probability that the reading of p3 stops changing."""
    frozen_p3_s: Annotated[Range, (0.0, 3600.0)] = (0.5, 8.0)
    """When it stops [s]."""
    worn: Probability = 0.0
    """Probability that the valve has effects of the catalogue, up to their typical sizes."""
    most_effects: int = 3
    """How many effects at most; their number is uniform. A worn valve has more than one fault."""
    biased_p2: Probability = 0.0
    """Probability that the reading of p2 is off."""
    bias_p2_bar: Annotated[Range, (-1.0, 1.0)] = (-0.256, 0.256)
    """By how much [bar]; Table 1 allows 1.6 % of 16 bar."""
    delayed: Probability = 0.0
    """Probability that the coil follows its command late."""
    delay_ms: Annotated[Range, (0.0, 10.0)] = (0.0, 5.0)
    """How late [ms]; the catalogue's typical delay is below 2, a slow network's is 5."""
    extreme: Probability = 0.0
    """Probability that the plant lies near a corner of its region: rare valves become common."""
    braking: Probability = 0.0
    """Probability that the consumption is that of emergencies, the hardest."""

    def __post_init__(self) -> None:
        check_limits(self, "conditions: ")
        check_count("conditions: most_effects", self.most_effects, most=10)

    @property
    def ordinary(self) -> bool:
        """Whether nothing can happen."""
        return not any(getattr(self, name) for name in PROBABILITIES)


PROBABILITIES = tuple(entry.name for entry in fields(Conditions) if entry.type == Probability)
"""Fields of Conditions that are probabilities, in the order in which the conditions act."""

CONDITIONS: dict[str, Conditions] = {
    "ordinary": Conditions(),
    "broad": Conditions(
        far=0.1, vented=0.1, coil_off=0.1, rest=0.15, target_steps=0.2, starved=0.1, noisy=0.5,
        frozen_p3=0.05, biased_p2=0.1, delayed=0.3, worn=0.3,
    ),
}  # fmt: skip
"""By name. "broad" is for training a policy for the real thing: about one episode in ten is ordinary,
and the dearest conditions, effects and delays, still leave half of the episodes to the fast kernel."""


def as_conditions(value: Any) -> Conditions:
    """Conditions from themselves, a name of CONDITIONS, a mapping of fields, or None (ordinary).

    Raises OptionError.
    """
    if value is None:
        return CONDITIONS["ordinary"]
    if isinstance(value, Conditions):
        return value
    if isinstance(value, str) and value in CONDITIONS:
        return CONDITIONS[value]
    if not isinstance(value, Mapping):
        raise OptionError(
            f"conditions is {shown(value)}: give one of {', '.join(CONDITIONS)}, a Conditions, or a "
            "mapping of its fields"
        )
    check_known("condition", value, [entry.name for entry in fields(Conditions)])
    return Conditions(**value)
