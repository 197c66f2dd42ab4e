"""Scenarios of the evaluation: ordinary ones, ones beyond training, and worn valves.

`run_episodes` takes a scenario's `options` as they are. Those of the environment
(epv_env/plant/consumption.py) serve training and tuning; most of the scenarios here are not among them.

BEYOND: each differs in one thing from an ordinary episode, which comes first. All are judged by C1, the
band after the settling time. The valve cannot let air out of the circuit, so no episode begins above the
target, and targets only rise. Where an episode begins far below the target, `settling_time` leaves the
time of the refill. Nothing is drawn until it ends, so an overshoot remains and counts.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

from epv_env.plant.consumption import MIXED, SCENARIOS, Scenario
from epv_env.plant.effects.record import Size
from epv_env.plant.effects.registry import EFFECTS
from epv_env.plant.parameters import table
from epv_env.plant.supply import Supply
from epv_env.signals import MovingTarget
from training.evaluation.sensor_faults import FAULTS, Fault

TUNING_REGION = "sensitive_ten_percent"
"""Plants tuned on: those that PPO trains on."""

RANDOM = "random"
"""The scenario that the probabilities refer to: everything drawn as in training, but unseen."""


@dataclass(frozen=True, kw_only=True)
class EvaluationScenario:
    """A named situation; every episode of it is another draw."""

    options: dict[str, Any] = field(default_factory=dict)
    """Of the environment: consumption, target, supply, first pressure; defaults elsewhere."""
    duration: float | None = None
    """Of an episode [s]; None: as long as the comparison's others."""
    restart_s: float | None = None
    """When the control unit restarts, so that the controller forgets everything [s]; None: never."""
    faults: tuple[Fault, ...] = ()
    """Of the sensors that the controller reads, from `sensor_faults.BEGINS_S` on."""


def consumption(like: str | None = None, **ranges: Any) -> Scenario:
    """A consumption of its own, or one of the environment's with other ranges."""
    if like is None:
        return Scenario(meaning="of an evaluation scenario", **ranges)
    return replace(SCENARIOS[like], **ranges)


def _situation(**options: Any) -> EvaluationScenario:
    """A scenario with these options of the environment."""
    return EvaluationScenario(options=options)


NAMED: dict[str, EvaluationScenario] = {
    "rest": _situation(scenario="none"),
    "leak": _situation(scenario="leak"),
    "steady draw": _situation(scenario=consumption(leak=(1.0, 4.0))),
    "service": _situation(scenario="service"),
    "steps": _situation(scenario="steps"),
    "one emergency": _situation(
        scenario=consumption(
            "emergency", flow=(5.0, 5.5), hold=(2.0, 3.0), first=(2.0, 4.0), pause=(60.0, 60.0)
        )
    ),
    "emergencies": _situation(scenario="emergency"),
    "pumping": _situation(scenario="pumping"),
    "anti-lock": _situation(  # faster than in any training: six to twelve bursts a second
        scenario=consumption("pumping", flow=(3.0, 5.5), hold=(0.04, 0.08), pause=(0.04, 0.08))
    ),
    "creeping": _situation(scenario="creeping"),
    "staircase": _situation(scenario=consumption(flow=(0.5, 5.0), hold=(0.3, 0.8), pause=(0.0, 0.0))),
    "parking": _situation(  # the valve has to wake up
        scenario=consumption(flow=(2.0, 4.0), hold=(0.1, 0.3), pause=(2.5, 3.5), first=(2.5, 3.5))
    ),
    "worst repeated": _situation(  # the largest step, at the pace of the valve's own overshoot
        scenario=consumption(flow=(5.5, 5.5), hold=(0.2, 0.4), pause=(0.2, 0.4))
    ),
    "compressor off": _situation(
        scenario="emergency",
        supply=replace(Supply.reservoirs((9.5, 10.5), volume_litres=40.0), delivery=0.0),
        target_bar=(6.0, 7.5),
    ),
    "low supply": _situation(scenario=MIXED, supply=Supply.constant(8.5, 9.5), target_bar=(7.0, 8.0)),
    "high target": _situation(scenario=MIXED, target_bar=(9.5, 10.2)),
    "low target": _situation(  # the open valve passes most
        scenario=MIXED, supply=Supply.constant(12.5), target_bar=(4.5, 6.0)
    ),
    "low battery": _situation(scenario=MIXED, supply_voltage=21.0),  # the coil pulls in late
}
"""Situations by name."""

EVALUATION: dict[str, EvaluationScenario] = {RANDOM: _situation(scenario=MIXED), **NAMED}
"""The ordinary scenarios: random ones as in training, and the named situations."""

REFILL_TIME = 1.5
"""An open valve refills the circuit from 4.4 bar below the target within 1 s; with a margin [s]."""

VENTED_DROP_BAR = (3.0, 4.0)
"""First p2 below the target where the valve begins open. Closing it takes so long that p2 rises by 0.8
to 2.7 bar (64 plants within ±10 %): nearer to the target no controller could avoid overshoot [bar]."""


def _late_emergency(at: float) -> Any:
    """Nothing is drawn until one emergency at this time [s]."""
    return consumption("emergency", flow=(5.0, 5.5), hold=(1.5, 2.0), first=(at, at), pause=(60.0, 60.0))


def _recovery(low: float, high: float, **options: Any) -> EvaluationScenario:
    """An episode that begins this far below the target [bar], with an emergency after the refill.

    options: further ones.
    """
    return _situation(
        drop_bar=(low, high), settling_time=REFILL_TIME,
        scenario=_late_emergency(REFILL_TIME + 1.0), **options,
    )  # fmt: skip


def _rest(seconds: float) -> EvaluationScenario:
    """An emergency after a rest [s]."""
    return EvaluationScenario(options={"scenario": _late_emergency(seconds)}, duration=seconds + 4.0)


BEYOND: dict[str, EvaluationScenario] = {
    "as in training": _situation(),
    "2 to 4 bar below": _recovery(2.0, 4.0),
    "4 to 4.4 bar below": _recovery(4.0, 4.4),
    "vented": _recovery(*VENTED_DROP_BAR, p3_bar=(1.0, 1.0)),
    "target steps": _situation(
        target_bar=MovingTarget.recorded(
            [0, 2, 2.001, 4, 4.001, 6, 6.001, 8, 8.001],
            [6.5, 6.5, 6.75, 6.75, 7.0, 7.0, 7.25, 7.25, 7.5],
        ),
        drop_bar=(0.0, 0.3),
    ),
    **{f"rest of {seconds} s": _rest(seconds) for seconds in (8, 20, 40, 80)},
    # Every needless opening remains as overshoot.
    "60 s at rest": EvaluationScenario(options={"scenario": "none"}, duration=60.0),
    "starved": _situation(
        conditions={"starved": 1.0, "starved_bar": (1.0, 2.0), "starved_s": 3.0},
        drop_bar=(1.0, 2.0),
        settling_time=3.0 + REFILL_TIME,
        scenario="none",
    ),
    # Training ends at 5.5 g/s.
    "8 g/s": _situation(scenario=consumption("steps", flow=(8.0, 8.0))),
    "restart": EvaluationScenario(restart_s=5.0),
    # Table 1 allows 1.6 % of 16 bar.
    "p2 biased": _situation(effects={"pressure_sensor_bias": {"b_p2": 25.6e3}}),
    "latency of 5 ms": _situation(effects={"command_delay": 5e-3}),
    "period of 4 ms": _situation(control_period=4e-3),
    "period of 6 ms": _situation(control_period=6e-3),
}
"""Scenarios beyond training by name; plants within ±10 % (TUNING_REGION)."""

FAULTY = ("p1", "p3", "current")
"""Sensors that fail in a scenario. With p2 wrong no controller holds the band."""
SENSOR_FAULTS: dict[str, EvaluationScenario] = {
    **{
        f"{channel} {fault}": EvaluationScenario(faults=((channel, fault),))
        for channel in FAULTY
        for fault in FAULTS[:-1]
    },
    "p1 and p3 swapped": EvaluationScenario(faults=(("p1", "swapped"), ("p3", "swapped"))),
}
"""Ordinary episodes in which a sensor fails, by name."""

LEVELS = ("small", "typical", "top")
"""Sizes at which an effect of the gap catalogue is tried."""


def effect_levels() -> Iterator[tuple[str, str, dict[str, float]]]:
    """(effect, level, sizes by symbol [SI]) of every effect, variant and sign, at LEVELS.

    Small is the least and typical the (geometric) middle of what sealed trials draw; top is the end of
    the physical range, which may lie far beyond what a sound valve has. All have their usual form.
    """
    for effect in EFFECTS:
        for variant in effect.variants.values():
            sizes = tuple(size for size in variant if size.spread is None)
            for sign in (1, -1) if sizes[0].either_sign else (1,):
                name = _name(effect.name, sizes, sign, several=len(effect.variants) > 1)
                for level in LEVELS:
                    yield name, level, {size.symbol: _size(size, level, sign) for size in sizes}


def _name(effect: str, sizes: tuple[Size, ...], sign: int, *, several: bool) -> str:
    """The effect, with the symbol where variants differ in it, and the sign where it has two."""
    symbol = f" {sizes[0].symbol}" if several else ""
    ending = {1: " +", -1: " −"}[sign] if sizes[0].either_sign else ""
    return f"{effect}{symbol}{ending}"


def _size(size: Size, level: str, sign: int) -> float:
    """A size, with its sign [SI]."""
    low, high = size.drawn or size.swept or (0.0, 0.0)
    if size.stronger_when_smaller:
        return {"small": high, "typical": size.typical, "top": low}[level]
    least, greatest = table()[size.symbol].domain or (0.0, 0.0)
    if level == "top":
        return greatest if sign > 0 else least
    return sign * (low if level == "small" else size.typical)


def worn_scenarios() -> dict[str, EvaluationScenario]:
    """A scenario for each effect of the catalogue, variant and sign, at its typical size."""
    owners = {symbol: effect.name for effect in EFFECTS for symbol in effect.symbols}
    return {
        f"worn: {name}": _situation(effects={owners[next(iter(sizes))]: sizes})
        for name, level, sizes in effect_levels()
        if level == "typical"
    }


def scenario_group(name: str) -> dict[str, EvaluationScenario]:
    """The scenarios that a name on a command line stands for: one, or a group of them.

    Groups: `named` (ordinary situations), `beyond` (beyond training), `faults` (of sensors), `worn` (one
    effect each).
    Raises ValueError for an unknown name.
    """
    groups = {"named": NAMED, "beyond": BEYOND, "faults": SENSOR_FAULTS, "worn": worn_scenarios()}
    if name in groups:
        return groups[name]
    known = {**EVALUATION, **BEYOND, **SENSOR_FAULTS, **groups["worn"]}
    if name not in known:
        raise ValueError(
            f"no scenario {name!r}: give {', '.join(groups)}, or some of {', '.join(known)}"
        )
    return {name: known[name]}
