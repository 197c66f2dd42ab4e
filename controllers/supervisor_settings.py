"""How a supervisor corrects its policy: what training settles, and what was chosen by hand."""

from dataclasses import dataclass

from controllers.reserve import TOLERATED
from epv_env.reward import BAND_BAR


@dataclass(frozen=True, kw_only=True)
class SupervisorSettings:
    """How a supervisor corrects its policy.

    Training settles `height`, `free_below`, `reluctance` and `ceiling` for each policy, and sets
    `near_miss_share` (training/learners/supervision.py). The others were chosen by hand on development
    episodes.
    """

    height: float = 0.0
    """How much higher than the policy alone p2 is held at any valve [bar]."""
    free_below: float = 0.0
    """Forecast of p2 - target, for when the valve would open, up to which the policy alone decides
    whether a pulse begins [bar]."""
    reluctance: float = 0.0
    """For each bar of the forecast above that, by how much the policy's logit of switching off must
    exceed that of leaving on before a pulse begins [1/bar]: such a pulse is needed only if it is wanted
    clearly."""
    near_miss_share: float = 0.0
    """Share of a breakdown beyond `near_miss` by which p2 is held higher afterwards [1]."""
    near_miss: float = 0.25
    """Breakdown below the target from which p2 is held higher and pulses are held back less [bar]."""
    memory_time: float = 60.0
    """Time in which the memory of a breakdown fades by 1/e [s]."""
    share: float = 0.5
    """Share of the reserve that a valve needs beyond that [1]: the policy keeps some by itself."""
    tolerated: float = TOLERATED
    """Expected breakdown that needs no reserve [bar]."""
    wariness: float = 0.15
    """Breakdown expected in addition for a bar of the opening pressure's standard deviation [1]."""
    ceiling: float = 0.15
    """p2 - target that a pulse may reach if the valve opens early, or else it ends [bar]."""
    confidence: float = 0.95
    """Probability that the valve opens no earlier than is allowed for there [1]. While a valve is
    unknown, it is `UNKNOWN_CONFIDENCE` (controllers/governor.py)."""
    doubt: float = 2.0
    """Standard deviations of the gain that are allowed for there [1]."""
    horizon: float = 0.1
    """Time over which consumption lowers p2 there [s]: an overshoot in an emergency does not last."""
    filter_time: float = 0.025
    """Time in which the weight of a reading of p2 fades by 1/e [s]."""

    def __post_init__(self) -> None:
        for name in ("height", "free_below"):
            if not abs(value := getattr(self, name)) <= BAND_BAR:
                raise ValueError(f"{name} = {value:g} bar: give one within ±{BAND_BAR:g} bar")
        for name in (
            "reluctance", "near_miss_share", "near_miss", "share", "wariness", "doubt", "horizon",
        ):  # fmt: skip
            if not 0 <= getattr(self, name) < float("inf"):
                raise ValueError(f"{name} = {getattr(self, name):g}: give a number from 0")
        if not 0 < self.confidence < 1:
            raise ValueError(f"confidence = {self.confidence:g}: give a number between 0 and 1")
        for name in ("memory_time", "filter_time"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} = {getattr(self, name):g} s: give a positive time")


SETTINGS = SupervisorSettings()
