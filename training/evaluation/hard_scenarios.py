"""Scenarios beyond training: starts far off, long rests, starvation, faults, timing.

Each differs in one thing from an ordinary episode, which comes first. All are judged by C1, the band
after the settling time. The valve cannot let air out of the circuit, so no episode begins above the
target, and targets only rise. Where an episode begins far below the target, `settling_time` leaves the
time of the refill. Nothing is drawn until it ends, so an overshoot remains and counts.
"""

from dataclasses import dataclass, replace
from typing import Any

from epv_env.signals import MovingTarget
from training.evaluation.faults import Restart
from training.evaluation.scenarios import TUNING_REGION, EvaluationScenario, consumption

REFILL_TIME = 1.5
"""An open valve refills the circuit from 4.4 bar below the target within 1 s; with a margin [s]."""

VENTED_DROP_BAR = (3.0, 4.0)
"""First p2 below the target where the valve begins open. Closing it takes so long that p2 rises by 0.8
to 2.7 bar (64 plants within ±10 %): nearer to the target no controller could avoid overshoot [bar]."""


@dataclass(frozen=True, kw_only=True)
class HardScenario(EvaluationScenario):
    """A scenario with its own length, and perhaps a fault."""

    duration: float = 10.0
    """Of an episode [s]."""
    fault: Restart | None = None
    """What the controller suffers from; None: nothing."""

    @property
    def all_options(self) -> dict[str, Any]:
        """Of the environment; plants within ±10 %, everything else as in training unless named."""
        return {"parameters": TUNING_REGION, **self.options}


def _late_emergency(at: float) -> Any:
    """Nothing is drawn until one emergency at this time [s]."""
    return consumption("emergency", flow=(5.0, 5.5), hold=(1.5, 2.0), first=(at, at), pause=(60.0, 60.0))


def _recovery(low: float, high: float, **options: Any) -> HardScenario:
    """An episode that begins this far below the target [bar]; options: further ones."""
    return HardScenario(
        meaning=f"begins {low:g} to {high:g} bar below the target, an emergency after the refill",
        options={
            "drop_bar": (low, high), "settling_time": REFILL_TIME,
            "scenario": _late_emergency(REFILL_TIME + 1.0), **options,
        },
    )  # fmt: skip


def _rest(seconds: float) -> HardScenario:
    """An emergency after a rest [s]."""
    return HardScenario(
        meaning=f"nothing is drawn for {seconds:g} s, then an emergency",
        options={"scenario": _late_emergency(seconds)},
        duration=seconds + 4.0,
    )


HARD: dict[str, HardScenario] = {
    "as in training": HardScenario(meaning="nothing differs: plants within ±10 %"),
    "2 to 4 bar below": _recovery(2.0, 4.0),
    "4 to 4.4 bar below": _recovery(4.0, 4.4),
    "vented": replace(
        _recovery(*VENTED_DROP_BAR, p3_bar=(1.0, 1.0)),
        meaning="the control chamber begins vented, so the valve is open, 3 to 4 bar below the target",
    ),
    "target steps": HardScenario(
        meaning="target 6.5 bar, raised by 0.25 bar at 2, 4, 6 and 8 s",
        options={
            "target_bar": MovingTarget.recorded(
                [0, 2, 2.001, 4, 4.001, 6, 6.001, 8, 8.001],
                [6.5, 6.5, 6.75, 6.75, 7.0, 7.0, 7.25, 7.25, 7.5],
            ),
            "drop_bar": (0.0, 0.3),
        },
    ),
    **{f"rest of {seconds} s": _rest(seconds) for seconds in (8, 20, 40, 80)},
    "60 s at rest": HardScenario(
        meaning="nothing is drawn at all: every needless opening remains as overshoot",
        options={"scenario": "none"},
        duration=60.0,
    ),
    "starved": HardScenario(
        meaning="supply 1 to 2 bar below the target, refilled within a second from 3 s on",
        options={
            "conditions": {"starved": 1.0, "starved_bar": (1.0, 2.0), "starved_s": 3.0},
            "drop_bar": (1.0, 2.0), "settling_time": 3.0 + REFILL_TIME, "scenario": "none",
        },
    ),
    "8 g/s": HardScenario(
        meaning="sudden applications of 8 g/s: training ends at 5.5 g/s",
        options={"scenario": consumption("steps", flow=(8.0, 8.0))},
    ),
    "restart": HardScenario(
        meaning="the control unit restarts at 5 s", fault=Restart(at=5.0)
    ),
    "p3 frozen": HardScenario(
        meaning="the reading of p3 stops changing at 2 s",
        options={"conditions": {"frozen_p3": 1.0, "frozen_p3_s": 2.0}},
    ),
    "p2 biased": HardScenario(
        meaning="the reading of p2 is 0.256 bar too high (Table 1: 1.6 % of 16 bar)",
        options={"effects": {"pressure_sensor_bias": {"b_p2": 25.6e3}}},
    ),
    "latency of 5 ms": HardScenario(
        meaning="the coil follows its command after 5 ms",
        options={"effects": {"command_delay": 5e-3}},
    ),
    "period of 4 ms": HardScenario(
        meaning="a decision every 4 ms instead of 5", options={"control_period": 4e-3}
    ),
    "period of 6 ms": HardScenario(
        meaning="a decision every 6 ms instead of 5", options={"control_period": 6e-3}
    ),
}  # fmt: skip
"""By name."""
