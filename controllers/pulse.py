"""Adaptive pulse control: planned pulses on a table that follows the valve.

The idea is the report's own deactivation pulse (section 3), planned instead of fixed. A pulse begins
when p2 - target, extrapolated to the instant at which the vented valve would open, is below a trigger.
While the coil is off, its remaining time is planned anew in every period from the measured pressures. So
errors of the model are corrected until the last period. The coil switches at whole periods only, and one
period may be worth 200 mbar.

A self-tuning regulator (Astrom and Wittenmark, Adaptive Control, 2nd ed. 1995, chapter 3) with two
corrections: a pulse aims lower by what is uncertain about its rise, and p2 is held higher where the
valve is slow to open.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.base import OneValve, compiled, composed, over_batch
from controllers.pulse_table import PulseTable, duration, nominal_table, pulse_tables
from controllers.registration import Range, Registration
from controllers.valve_learner import FILTER_TIME, LEAST_HEAD, VALVE, begin, observe
from epv_env.plant.plantfile import Plant
from epv_env.task import LimitingTask


class PulsePlan(NamedTuple):
    """How pulses are planned; the defaults are the tuned values of the adaptive controller."""

    trigger: float = -0.039
    """Predicted p2 - target below which a pulse begins [bar]."""
    aim: float = 0.082
    """p2 - target at which a pulse shall end [bar]."""
    caution: float = 0.42
    """How much lower a pulse aims for each bar of the opening pressure's standard deviation [1]."""
    doubt: float = 1.42
    """Standard deviations of the gain that a pulse allows for in what p2 will still rise [1]."""
    look_ahead: float = 0.98
    """Share of the time to open over which p2 is extrapolated [1]."""
    rounding: float = 0.75
    """Remaining time below which a pulse ends now [control periods]: 0.5 rounds, 1 never overshoots."""


PLAN = PulsePlan()
"""Of the adaptive controller."""
INFORMED_PLAN = PulsePlan(trigger=-0.06, aim=0.10, caution=0.0, doubt=0.0, look_ahead=1.5, rounding=0.8)
"""Of the informed controller: near the best of 200 settings that TPE tried on 384 tuning episodes."""


@compiled
def plan(v: Any, table: Any, t: int, p: Any, period: float) -> None:
    """Advise one valve: `advised` is 0 (coil off) or 1 (on).

    `margin` tells how far the forecast lies above the trigger [bar], `remaining` how long a pulse under
    way still lasts [s].

    v: record of controllers.valve_learner.VALVE, changed. table: of the plants. t: the valve's plant in
    the table. p: a PulsePlan. period: control period [s].
    """
    fed = v.head > LEAST_HEAD
    ahead = p.look_ahead * (max(v.opens_in, 0.0) + table.release_lag[t])
    v.margin = v.error + v.fall * ahead - p.trigger - v.reserve
    v.remaining = 0.0
    if v.on > 0:
        v.advised = 0.0 if fed and v.opens_in > 0 and v.margin < 0 else 1.0
        return
    by_gain = p.doubt * v.gain_deviation * v.under_way / v.gain
    uncertain = math.sqrt((p.caution * v.offset_deviation) ** 2 + by_gain**2)
    asked = (p.aim + v.reserve - uncertain - v.error) / v.gain
    slope = v.fall / (v.gain * v.pace)
    v.remaining = duration(table, t, v.offset, v.p1, v.p2, v.p3, asked, slope) / v.pace
    v.advised = 1.0 if not fed or v.remaining < p.rounding * period else 0.0


class Knowledge(NamedTuple):
    """What a pulse controller goes by, for compiled code."""

    table: PulseTable
    plan: PulsePlan
    filter_time: float
    informed: bool
    """Whether the table is of each valve's own plant."""


def nominal_knowledge(plant: Plant) -> Knowledge:
    """Of the adaptive pulse that advises a policy of this nominal plant."""
    return Knowledge(nominal_table(plant), PLAN, FILTER_TIME, False)


@composed
def follow(v, r, observation, c, period):
    """Learn from one valve's readings, and plan. c: a Knowledge."""
    if v.begun == 0:
        begin(v, c.informed)
    total = 0.0
    for entry in observation:
        total += entry
    if math.isfinite(total):  # of what is not finite nothing is learnt
        observe(v, c.table, int(v.plant), r, period, c.filter_time, c.informed)
    plan(v, c.table, int(v.plant), c.plan, period)


@compiled
def decide(v, r, observation, c, period):
    """One valve's decision (controllers.base.OneValve)."""
    follow(v, r, observation, c, period)
    return v.advised


class _Pulse(OneValve):
    """Acts as `plan` advises."""

    decide, decide_all = staticmethod(decide), over_batch(decide)
    record = VALVE


@dataclass(kw_only=True)
class AdaptivePulse(_Pulse):
    """Acts as `plan` advises, on what it learns about each valve from the valve's own pulses."""

    plant: Plant = field(repr=False)
    """The nominal plant."""
    pulse: PulsePlan = PLAN
    """How pulses are planned."""
    filter_time: float = FILTER_TIME
    """Time in which the weight of a reading of p2 fades by 1/e [s]."""
    control_period: float = 5e-3
    """[s]"""
    name: str = "adaptive pulse"
    environment: str = "EPValve-v0"

    def __post_init__(self) -> None:
        if self.pulse.trigger >= self.pulse.aim:
            raise ValueError(
                f"trigger = {self.pulse.trigger:g} bar is not below aim = {self.pulse.aim:g} bar: a "
                "pulse only adds pressure, give trigger < aim"
            )
        self.constants = Knowledge(nominal_table(self.plant), self.pulse, self.filter_time, False)


@dataclass(kw_only=True)
class InformedPulse(_Pulse):
    """The same with each valve's own parameters, which no ECU knows: what knowing them is worth.

    It measures the state as the other controllers do and has no foresight.
    """

    pulse: PulsePlan = INFORMED_PLAN
    """How pulses are planned."""
    filter_time: float = 0.0125
    """Time in which the weight of a reading of p2 fades by 1/e [s]."""
    name: str = "informed pulse"
    environment: str = "EPValve-v0"

    def watch(self, task: LimitingTask) -> None:
        """Make the tables of the episodes that have just begun (controllers.base.Privileged).

        A plant met for the first time takes a fifth of a second.
        """
        plants = [parameters for parameters in task.parameters if parameters is not None]
        assert len(plants) == task.n, "the episodes must have begun"
        tables = pulse_tables(plants, task.settings.supply_voltage)
        self.constants = Knowledge(tables, self.pulse, self.filter_time, True)
        self.control_period = task.period
        self.reset(task.n)
        self.memory["plant"] = np.arange(task.n)

    def act(self, observations: NDArray) -> NDArray:
        """0 (off) or 1 (on) for each valve, (n,). Raises ValueError if no task is watched."""
        if not hasattr(self, "constants"):
            raise ValueError(
                "the informed pulse controller sees no task: call watch(env.task) after the reset"
            )
        return super().act(observations)


def _adaptive(values: Mapping[str, Any], plant: Plant) -> AdaptivePulse:
    """From the tuned quantities by name."""
    planned = {name: value for name, value in values.items() if name != "filter_time"}
    return AdaptivePulse(plant=plant, pulse=PulsePlan(**planned), filter_time=values["filter_time"])


ADAPTIVE_PULSE = Registration(
    kind="adaptive pulse",
    controller=AdaptivePulse,
    build=_adaptive,
    search_space={
        "trigger": Range(low=-0.3, high=0.1),
        "aim": Range(low=-0.1, high=0.3),
        "caution": Range(low=0.0, high=0.6),
        "doubt": Range(low=0.0, high=1.5),
        "filter_time": Range(low=0.004, high=0.04, log=True),
        "look_ahead": Range(low=0.3, high=1.5),
        "rounding": Range(low=0.2, high=1.2),
    },
)

INFORMED_PULSE = Registration(
    kind="informed pulse",
    controller=InformedPulse,
    build=lambda values, plant: InformedPulse(),
    search_space=None,
)
