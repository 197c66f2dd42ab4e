"""Scenarios of the evaluation: consumption of the circuit, target, and supply.

`run_episodes` takes a scenario's `options` as they are. Those of the environment
(epv_env/plant/consumption.py) serve training and tuning; most of the scenarios here are not among them.
"""

from dataclasses import dataclass, field, replace
from typing import Any

from epv_env.plant.consumption import MIXED, SCENARIOS, Scenario
from epv_env.plant.supply import Supply

TUNING_REGION = "sensitive_ten_percent"
"""Plants tuned on: those that PPO trains on."""

RANDOM = "random"
"""The scenario that the probabilities refer to: everything drawn as in training, but unseen."""


@dataclass(frozen=True, kw_only=True)
class EvaluationScenario:
    """A named situation; every episode of it is another draw."""

    meaning: str
    options: dict[str, Any] = field(default_factory=dict)
    """Of the environment: consumption, target, supply, first pressure; defaults elsewhere."""


def consumption(like: str | None = None, **ranges: Any) -> Scenario:
    """A consumption of its own, or one of the environment's with other ranges."""
    if like is None:
        return Scenario(meaning="of an evaluation scenario", **ranges)
    return replace(SCENARIOS[like], **ranges)


_NO_COMPRESSOR = replace(Supply.reservoirs((9.5, 10.5), volume_litres=40.0), delivery=0.0)

NAMED: dict[str, EvaluationScenario] = {
    "rest": EvaluationScenario(
        meaning="nothing is drawn: reach the target, then keep still",
        options={"scenario": "none"},
    ),
    "leak": EvaluationScenario(
        meaning="a steady leak of 0.1 to 0.8 g/s",
        options={"scenario": "leak"},
    ),
    "steady draw": EvaluationScenario(
        meaning="1 to 4 g/s all the time",
        options={"scenario": consumption(leak=(1.0, 4.0))},
    ),
    "service": EvaluationScenario(
        meaning="service braking: ramps to 1 to 3.5 g/s every few seconds",
        options={"scenario": "service"},
    ),
    "steps": EvaluationScenario(
        meaning="sudden applications of 1.5 to 5 g/s",
        options={"scenario": "steps"},
    ),
    "one emergency": EvaluationScenario(
        meaning="a single application of 5 to 5.5 g/s for 2 to 3 s, after seconds of rest",
        options={
            "scenario": consumption(
                "emergency", flow=(5.0, 5.5), hold=(2.0, 3.0), first=(2.0, 4.0), pause=(60.0, 60.0)
            )
        },
    ),
    "emergencies": EvaluationScenario(
        meaning="hard applications of 1 to 2 s, again and again",
        options={"scenario": "emergency"},
    ),
    "pumping": EvaluationScenario(
        meaning="bursts of 2.5 to 5 g/s, three to eight a second",
        options={"scenario": "pumping"},
    ),
    "anti-lock": EvaluationScenario(
        meaning="faster modulation than any in training: six to twelve bursts of 3 to 5.5 g/s a second",
        options={
            "scenario": consumption("pumping", flow=(3.0, 5.5), hold=(0.04, 0.08), pause=(0.04, 0.08))
        },
    ),
    "creeping": EvaluationScenario(
        meaning="consumption that grows and fades over seconds",
        options={"scenario": "creeping"},
    ),
    "staircase": EvaluationScenario(
        meaning="levels of 0.5 to 5 g/s that follow one another without a pause",
        options={"scenario": consumption(flow=(0.5, 5.0), hold=(0.3, 0.8), pause=(0.0, 0.0))},
    ),
    "parking": EvaluationScenario(
        meaning="seconds of rest, then a short application: the valve has to wake up",
        options={
            "scenario": consumption(flow=(2.0, 4.0), hold=(0.1, 0.3), pause=(2.5, 3.5), first=(2.5, 3.5))
        },
    ),
    "worst repeated": EvaluationScenario(
        meaning="the largest step, 5.5 g/s, again and again at the pace of the valve's own overshoot",
        options={"scenario": consumption(flow=(5.5, 5.5), hold=(0.2, 0.4), pause=(0.2, 0.4))},
    ),
    "compressor off": EvaluationScenario(
        meaning="40 litres at 9.5 to 10.5 bar that nothing refills, emergencies",
        options={"scenario": "emergency", "supply": _NO_COMPRESSOR, "target_bar": (6.0, 7.5)},
    ),
    "low supply": EvaluationScenario(
        meaning="8.5 to 9.5 bar of supply, little above the target of 7 to 8 bar",
        options={"scenario": MIXED, "supply": Supply.constant(8.5, 9.5), "target_bar": (7.0, 8.0)},
    ),
    "high target": EvaluationScenario(
        meaning="target of 9.5 to 10.2 bar, close to the supply",
        options={"scenario": MIXED, "target_bar": (9.5, 10.2)},
    ),
    "low target": EvaluationScenario(
        meaning="target of 4.5 to 6 bar from 12.5 bar of supply: the open valve passes most",
        options={"scenario": MIXED, "supply": Supply.constant(12.5), "target_bar": (4.5, 6.0)},
    ),
    "low battery": EvaluationScenario(
        meaning="the coil gets 21 V instead of 24 V: it pulls in late",
        options={"scenario": MIXED, "supply_voltage": 21.0},
    ),
}
"""Situations by name."""

EVALUATION: dict[str, EvaluationScenario] = {
    RANDOM: EvaluationScenario(
        meaning="one of the environment's consumptions, target 6 to 9.5 bar, reservoirs: as in training",
        options={"scenario": MIXED},
    ),
    **NAMED,
}
"""All scenarios of the comparison."""
